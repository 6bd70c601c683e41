#include "reconstruct/kept_room/room_file.h"

#include <zlib.h>

#include <algorithm>
#include <array>
#include <cmath>
#include <cstring>
#include <fstream>
#include <span>
#include <string>
#include <system_error>
#include <utility>
#include <vector>

#include "capture/error.h"
#include "capture/message_text.h"
#include "reconstruct/kept_room/atomic_file.h"
#include "reconstruct/kept_room/brick_codec.h"
#include "reconstruct/kept_room/keyframe_file.h"
#include "reconstruct/kept_room/lamp_codec.h"
#include "reconstruct/kept_room/parameters.h"
#include "reconstruct/lamps/parameters.h"

namespace lumigraft::reconstruct {
namespace {

using capture::formatted;
using capture::InputError;

constexpr std::array<char, 8> kMagic = {'L', 'U', 'M', 'I', 'R', 'O', 'O', 'M'};
constexpr std::uint32_t kRoomFormat = 2;
constexpr std::size_t kMaxName_bytes = 1024;

enum Kind : std::uint32_t { kField, kCoarseField, kAlbedo, kLamps, kKinds };
constexpr std::array<const char*, kKinds> kKindNames = {"field", "coarse field", "albedo", "lamps"};

/// Numbers one after the other.
struct Sizes {
  double voxel_m = 0, truncation_m = 0;
  std::array<std::uint64_t, kKinds> counts{};  ///< of bricks; of lamps
};
static_assert(sizeof(Sizes) == 48);

struct ChunkHead {
  std::uint32_t kind = 0, count = 0, bytes = 0;
};
static_assert(sizeof(ChunkHead) == 12);

template <typename Value>
std::span<const std::uint8_t> bytes_of(const Value& value) {
  return {reinterpret_cast<const std::uint8_t*>(&value), sizeof(value)};
}

std::uint32_t checksum(std::span<const std::uint8_t> a, std::span<const std::uint8_t> b = {}) {
  const uLong first = crc32_z(0, a.data(), a.size());
  return static_cast<std::uint32_t>(b.empty() ? first : crc32_z(first, b.data(), b.size()));
}

template <typename Brick>
KeyedBricks<Brick> in_order_of_distance(const BrickMap<Brick>& bricks) {
  KeyedBricks<Brick> result(bricks.begin(), bricks.end());
  const auto squared = [](const BrickKey& key) {
    return std::int64_t{key[0]} * key[0] + std::int64_t{key[1]} * key[1] + std::int64_t{key[2]} * key[2];
  };
  std::ranges::sort(result, {}, [&](const auto& entry) { return std::pair(squared(entry.first), entry.first); });
  return result;
}

void write_chunk(AtomicFile& out, Kind kind, std::size_t count, const Bytes& content) {
  const ChunkHead head{kind, static_cast<std::uint32_t>(count), static_cast<std::uint32_t>(content.size())};
  out.write(bytes_of(head));
  out.write(bytes_of(checksum(bytes_of(head), content)));
  out.write(content);
}

template <typename Brick>
void write_bricks(AtomicFile& out, Kind kind, const KeyedBricks<Brick>& bricks, float parameter) {
  for (std::size_t first = 0; first < bricks.size(); first += kKeptRoom.file.chunk_bricks) {
    const auto begin = bricks.begin() + static_cast<std::ptrdiff_t>(first);
    const std::size_t count = std::min(kKeptRoom.file.chunk_bricks, bricks.size() - first);
    write_chunk(out, kind, count,
                encode_bricks(KeyedBricks<Brick>(begin, begin + static_cast<std::ptrdiff_t>(count)), parameter));
  }
}

/// Reads a file from its beginning.
class Reader {
 public:
  explicit Reader(const std::filesystem::path& file) : in_(file, std::ios::binary) {
    std::error_code error;
    size_ = std::filesystem::file_size(file, error);
    capture::refuse_if(error || !in_, error ? error.message() : "cannot be read");
  }
  /// Throws InputError if the file has not so many.
  void read(std::span<std::uint8_t> to) {
    if (left() < to.size())
      throw InputError(formatted("found %ju bytes, allowed: %zu at least, it is cut short", left(), to.size()));
    in_.read(reinterpret_cast<char*>(to.data()), static_cast<std::streamsize>(to.size()));
    capture::refuse_if(!in_, "cannot be read");
    at_ += to.size();
  }
  template <typename Value>
  Value read() {
    Value value;
    read({reinterpret_cast<std::uint8_t*>(&value), sizeof(value)});
    return value;
  }
  std::uintmax_t at() const { return at_; }
  std::uintmax_t left() const { return size_ - std::min(at_, size_); }

 private:
  std::ifstream in_;
  std::uintmax_t size_ = 0, at_ = 0;
};

bool equal(double a, double b) { return std::abs(a - b) <= 1e-6 * b; }

Sizes read_head(Reader& in, const capture::Tag& tag, const FusionSettings& settings) {
  Bytes head(kMagic.size() + 8);
  in.read(head);
  capture::refuse_if(!std::equal(kMagic.begin(), kMagic.end(), head.begin()),
                     "found another kind of file, allowed: a room that lumigraft kept");
  std::uint32_t format = 0, length = 0;
  std::memcpy(&format, &head[kMagic.size()], sizeof(format));
  std::memcpy(&length, &head[kMagic.size() + sizeof(format)], sizeof(length));
  if (format != kRoomFormat) throw InputError(formatted("format: found %u, allowed: %u", format, kRoomFormat));
  if (length < sizeof(Sizes) || length > sizeof(Sizes) + kMaxName_bytes)
    throw InputError(formatted("head: found a length of %u bytes, allowed: %zu to %zu", length, sizeof(Sizes),
                               sizeof(Sizes) + kMaxName_bytes));
  const std::size_t before = head.size();
  head.resize(before + length);
  in.read(std::span(head).subspan(before));
  const std::uint32_t found = in.read<std::uint32_t>(), computed = checksum(head);
  if (found != computed)
    throw InputError(formatted("head: found checksum %08x, allowed: %08x, it is damaged", found, computed));
  Sizes sizes;
  std::memcpy(&sizes, &head[before], sizeof(sizes));
  const std::string world(head.begin() + static_cast<std::ptrdiff_t>(before + sizeof(sizes)), head.end()),
      wanted = world_name(tag);
  capture::refuse_if(world != wanted, "world: found \"" + world + "\", allowed: \"" + wanted + "\"");
  if (!equal(sizes.voxel_m, settings.voxel_m))
    throw InputError(formatted("voxel_m: found %g, allowed: %g", sizes.voxel_m, settings.voxel_m));
  const double truncation_m = settings.voxel_m * settings.truncation_voxels;
  if (!equal(sizes.truncation_m, truncation_m))
    throw InputError(formatted("truncation_m: found %g, allowed: %g", sizes.truncation_m, truncation_m));
  for (std::size_t kind = 0; kind < kKinds; ++kind)
    if (const std::size_t most = kind == kLamps ? kLampParameters.memory.max_kept : kKeptRoom.file.max_bricks;
        sizes.counts[kind] > most)
      throw InputError(formatted("%s: found %ju%s, allowed: %zu", kKindNames[kind], std::uintmax_t{sizes.counts[kind]},
                                 kind == kLamps ? "" : " bricks", most));
  return sizes;
}

/// The content of the next chunk of this kind; `left`: how many of this kind have not come yet.
Bytes read_chunk(Reader& in, Kind kind, std::uint64_t left, ChunkHead& head) {
  head = in.read<ChunkHead>();
  const std::uint32_t found = in.read<std::uint32_t>();
  const std::uint64_t most = std::min<std::uint64_t>(left, kKeptRoom.file.chunk_bricks);
  if (head.kind != kind || head.count == 0 || head.count > most)
    throw InputError(formatted("found kind %u with %u, allowed: kind %u with 1 to %ju", head.kind, head.count,
                               unsigned{kind}, std::uintmax_t{most}));
  if (head.bytes > in.left())
    throw InputError(
        formatted("found %ju bytes, allowed: the %u of the chunk, the file is cut short", in.left(), head.bytes));
  Bytes content(head.bytes);
  in.read(content);
  const std::uint32_t computed = checksum(bytes_of(head), content);
  if (found != computed)
    throw InputError(formatted("found checksum %08x, allowed: %08x, it is damaged", found, computed));
  return content;
}

/// Calls `add(bytes, count)` with the content of each chunk of this kind.
template <typename Add>
void read_chunks(Reader& in, Kind kind, std::uint64_t count, const Add& add) {
  for (std::uint64_t done = 0; done < count;) {
    const std::string where = formatted("%s, chunk at byte %ju", kKindNames[kind], in.at());
    capture::with_error_context(where, [&] {
      ChunkHead head;
      const Bytes content = read_chunk(in, kind, count - done, head);
      add(content, std::size_t{head.count});
      done += head.count;
    });
  }
}

void read_field(Reader& in, Kind kind, std::uint64_t count, double max_mb, DistanceField& field) {
  const auto limit = static_cast<std::size_t>(1e6 * max_mb) / sizeof(FieldBrick);
  read_chunks(in, kind, count, [&](const Bytes& content, std::size_t bricks) {
    for (auto& [key, brick] : decode_field_bricks(content, bricks, field.truncation_m)) {
      capture::refuse_if(field.bricks.contains(key), formatted("found brick %d %d %d twice", key[0], key[1], key[2]));
      if (field.bricks.size() < limit) field.bricks.emplace(key, std::move(brick));
    }
  });
}

DistanceField empty_field(double voxel_m, double truncation_voxels) {
  DistanceField field;
  field.voxel_m = static_cast<float>(voxel_m);
  field.truncation_m = static_cast<float>(voxel_m * truncation_voxels);
  field.version = 1;
  return field;
}

KeptRoom read(const std::filesystem::path& file, const capture::Tag& tag, const FusionSettings& settings) {
  Reader in(file);
  const Sizes sizes = read_head(in, tag, settings);
  KeptRoom room;
  room.field = empty_field(settings.voxel_m, settings.truncation_voxels);
  read_field(in, kField, sizes.counts[kField], settings.max_memory_mb, room.field);
  DistanceField coarse = empty_field(kCoarse.voxels * settings.voxel_m, settings.truncation_voxels);
  read_field(in, kCoarseField, sizes.counts[kCoarseField], kCoarse.memory * settings.max_memory_mb, coarse);
  if (!coarse.bricks.empty()) room.field.coarse = std::make_shared<const DistanceField>(std::move(coarse));
  auto albedo = std::make_shared<AlbedoField>();
  albedo->voxel_m = room.field.voxel_m;
  read_chunks(in, kAlbedo, sizes.counts[kAlbedo], [&](const Bytes& content, std::size_t bricks) {
    for (auto& [key, brick] : decode_albedo_bricks(content, bricks))
      if (room.field.brick(key)) albedo->bricks.emplace(key, std::move(brick));
  });
  if (!albedo->bricks.empty()) room.albedo = std::move(albedo);
  read_chunks(in, kLamps, sizes.counts[kLamps], [&](const Bytes& content, std::size_t count) {
    for (const KeptLamp& lamp : decode_lamps(content, count)) room.lamps.push_back(lamp);
  });
  if (in.left() > 0) throw InputError(formatted("found %ju bytes after the last chunk, allowed: none", in.left()));
  return room;
}

}  // namespace

std::uintmax_t write_room(const std::filesystem::path& file, const KeptRoom& room, const capture::Tag& tag) {
  const KeyedBricks<FieldBrick> fine = in_order_of_distance(room.field.bricks);
  const KeyedBricks<FieldBrick> coarse =
      room.field.coarse ? in_order_of_distance(room.field.coarse->bricks) : KeyedBricks<FieldBrick>();
  KeyedBricks<AlbedoBrick> albedo;
  if (room.albedo) albedo = in_order_of_distance(room.albedo->bricks);
  // Of surface that was evicted meanwhile albedo is not kept either: this bounds the size.
  std::erase_if(albedo, [&](const auto& entry) { return !room.field.brick(entry.first); });
  const Sizes sizes{
      room.field.voxel_m, room.field.truncation_m, {fine.size(), coarse.size(), albedo.size(), room.lamps.size()}};
  const std::string world = world_name(tag);

  Bytes head(kMagic.begin(), kMagic.end());
  const auto append = [&](std::span<const std::uint8_t> bytes) { head.insert(head.end(), bytes.begin(), bytes.end()); };
  append(bytes_of(kRoomFormat));
  append(bytes_of(static_cast<std::uint32_t>(sizeof(sizes) + world.size())));
  append(bytes_of(sizes));
  head.insert(head.end(), world.begin(), world.end());
  append(bytes_of(checksum(head)));
  AtomicFile out(file);
  out.write(head);
  write_bricks(out, kField, fine, room.field.truncation_m);
  write_bricks(out, kCoarseField, coarse, room.field.coarse ? room.field.coarse->truncation_m : 0);
  write_bricks(out, kAlbedo, albedo, room.albedo_error);
  if (!room.lamps.empty()) write_chunk(out, kLamps, room.lamps.size(), encode_lamps(room.lamps));
  out.commit();
  return out.size();
}

KeptRoom read_room(const std::filesystem::path& file, const capture::Tag& tag, const FusionSettings& settings) {
  return capture::with_error_context(file.string(), [&] { return read(file, tag, settings); });
}

}  // namespace lumigraft::reconstruct
