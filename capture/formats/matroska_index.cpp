#include "capture/formats/matroska_index.h"

#include <algorithm>
#include <array>
#include <fstream>
#include <limits>

namespace lumigraft::capture {
namespace {

// Element IDs of RFC 8794 (EBML) and RFC 9559 (Matroska).
enum Id : std::uint64_t {
  kSegment = 0x18538067,
  kInfo = 0x1549A966,
  kTimestampScale = 0x2AD7B1,
  kCluster = 0x1F43B675,
  kTimestamp = 0xE7,
  kSimpleBlock = 0xA3,
  kBlockGroup = 0xA0,
  kBlock = 0xA1,
  kReferenceBlock = 0xFB,
};
constexpr std::uint64_t kUnknown = std::numeric_limits<std::uint64_t>::max();

struct Element {
  std::uint64_t id = 0;
  std::uint64_t begin = 0;  ///< of its content
  std::uint64_t size = 0;
  std::uint64_t end() const { return begin + size; }
};

class Walk {
 public:
  explicit Walk(const std::filesystem::path& file) {
    in_.rdbuf()->pubsetbuf(buffer_.data(), buffer_.size());
    in_.open(file, std::ios::binary);
    std::error_code error;
    length_ = std::filesystem::file_size(file, error);
    length_ = error ? 0 : length_;
  }

  std::optional<std::int64_t> end_ns() {
    std::optional<Element> last;
    std::uint64_t scale = 1'000'000;
    const bool all = top([&](const Element& element, std::uint64_t) {
      if (element.id == kInfo) {
        each(element, [&](const Element& e) { scale = e.id == kTimestampScale ? number(e) : scale; });
      } else if (element.id == kCluster) {
        last = element;
      }
      return true;
    });
    const std::optional<Pictures> pictures = all && last ? pictures_of(*last) : std::nullopt;
    constexpr auto kLatest = static_cast<std::uint64_t>(std::numeric_limits<std::int64_t>::max());
    if (!pictures || scale == 0 || pictures->newest > kLatest / scale) {
      return std::nullopt;
    }
    return static_cast<std::int64_t>(pictures->newest * scale);
  }

  std::vector<MatroskaCluster> clusters() {
    std::vector<MatroskaCluster> out;
    std::uint64_t before = 0, newest = 0;
    const bool all = top([&](const Element& element, std::uint64_t at) {
      if (element.id != kCluster) {
        return true;
      }
      const std::optional<Pictures> pictures = pictures_of(element);
      constexpr auto kLatest = static_cast<std::uint64_t>(std::numeric_limits<std::int64_t>::max());
      if (!pictures || pictures->oldest > pictures->newest || pictures->newest > kLatest ||
          (!out.empty() && pictures->oldest <= newest)) {
        return false;
      }
      out.push_back(
          {static_cast<std::int64_t>(at), static_cast<std::int64_t>(pictures->oldest), before, pictures->first_is_key});
      before += pictures->count;
      newest = pictures->newest;
      return true;
    });
    return all ? out : std::vector<MatroskaCluster>();
  }

 private:
  /// What a cluster holds; times in ticks.
  struct Pictures {
    std::uint64_t oldest = 0, newest = 0;  ///< oldest: the cluster's own, where that is earlier
    std::uint64_t count = 0;
    bool first_is_key = false;
  };

  /// Calls with each element of the segment and where it begins, up to where the file is torn or `action` says false.
  /// False where an element's length is unknown.
  template <typename Action>
  bool top(const Action& action) {
    for (std::uint64_t at = 0; at < length_;) {
      const std::optional<Element> element = read(at, length_);
      if (!element) {
        return true;
      }
      if (element->id == kSegment) {
        at = element->begin;
        continue;
      }
      if (element->size == kUnknown) {
        return false;
      }
      if (!action(*element, at)) {
        return true;
      }
      at = element->end();
    }
    return true;
  }

  /// Bytes of a number with a marker of its length, RFC 8794, 4; empty where there is none.
  std::optional<std::uint64_t> variable(int longest, bool keep_marker) {
    const int first = in_.get();
    int length = 1;
    while (length <= longest && (first & (0x100 >> length)) == 0) {
      ++length;
    }
    if (first < 0 || length > longest) {
      return std::nullopt;
    }
    std::uint64_t value = static_cast<std::uint64_t>(keep_marker ? first : first & (0xFF >> length));
    for (int i = 1; i < length; ++i) {
      const int next = in_.get();
      if (next < 0) {
        return std::nullopt;
      }
      value = value << 8 | static_cast<std::uint64_t>(next);
    }
    const bool all_ones = value == (std::uint64_t{1} << (7 * length)) - 1;
    return all_ones && !keep_marker ? kUnknown : value;
  }

  /// Empty where it does not lie within `limit` as a whole, or too many were asked for.
  std::optional<Element> read(std::uint64_t at, std::uint64_t limit) {
    constexpr int kMostElements = 4'000'000;  // a day of pictures
    if (++elements_ > kMostElements) {
      return std::nullopt;
    }
    in_.clear();
    in_.seekg(static_cast<std::streamoff>(at));
    const auto id = variable(4, true);
    const auto size = id ? variable(8, false) : std::nullopt;
    if (!size) {
      return std::nullopt;
    }
    const Element element{*id, static_cast<std::uint64_t>(in_.tellg()), *size};
    if (element.begin > limit || (element.size != kUnknown && element.size > limit - element.begin)) {
      return element.id == kSegment ? std::optional(element) : std::nullopt;  // a Segment may be cut short
    }
    return element;
  }

  template <typename Action>
  void each(const Element& parent, const Action& action) {
    for (std::uint64_t at = parent.begin; at < parent.end();) {
      const std::optional<Element> child = read(at, parent.end());
      if (!child || child->size == kUnknown) {
        return;
      }
      action(*child);
      at = child->end();
    }
  }

  std::uint64_t number(const Element& element) {
    in_.clear();
    in_.seekg(static_cast<std::streamoff>(element.begin));
    std::uint64_t value = 0;
    for (std::uint64_t i = 0; i < element.size && i < 8; ++i) {
      value = value << 8 | static_cast<std::uint8_t>(in_.get());
    }
    return value;
  }

  struct Head {
    std::int16_t after = 0;  ///< ticks after its cluster's
    std::uint8_t flags = 0;
  };
  /// Two signed bytes and one of flags behind the number of the track.
  Head head_of(const Element& block) {
    in_.clear();
    in_.seekg(static_cast<std::streamoff>(block.begin));
    variable(8, false);
    const auto high = static_cast<std::uint8_t>(in_.get()), low = static_cast<std::uint8_t>(in_.get());
    return {static_cast<std::int16_t>(high << 8 | low), static_cast<std::uint8_t>(in_.get())};
  }

  /// Empty where it has no time.
  std::optional<Pictures> pictures_of(const Element& cluster) {
    constexpr std::uint8_t kKeyFlag = 0x80;
    std::optional<std::uint64_t> time;
    Pictures out;
    std::int16_t least = 0, most = 0;
    const auto add = [&](std::int16_t after, bool key) {
      least = std::min(least, after);
      most = std::max(most, after);
      out.first_is_key = out.count == 0 ? key : out.first_is_key;
      ++out.count;
    };
    each(cluster, [&](const Element& e) {
      if (e.id == kTimestamp) {
        time = number(e);
      } else if (e.id == kSimpleBlock) {
        const Head head = head_of(e);
        add(head.after, (head.flags & kKeyFlag) != 0);
      } else if (e.id == kBlockGroup) {
        std::optional<Head> head;
        bool key = true;
        each(e, [&](const Element& inner) {
          head = inner.id == kBlock ? std::optional(head_of(inner)) : head;
          key = key && inner.id != kReferenceBlock;
        });
        if (head) {
          add(head->after, key);
        }
      }
    });
    if (!time) {
      return std::nullopt;
    }
    out.oldest = *time + static_cast<std::uint64_t>(least);
    out.newest = *time + static_cast<std::uint64_t>(most);
    return out;
  }

  std::array<char, 64> buffer_{};  ///< a head and no more: pictures lie between
  std::ifstream in_;
  std::uint64_t length_ = 0;
  int elements_ = 0;
};

}  // namespace

std::optional<std::int64_t> matroska_end_ns(const std::filesystem::path& file) { return Walk(file).end_ns(); }

std::vector<MatroskaCluster> matroska_clusters(const std::filesystem::path& file) { return Walk(file).clusters(); }

}  // namespace lumigraft::capture
