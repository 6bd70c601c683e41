#include "capture/formats/picture_list.h"

#include <charconv>
#include <cmath>
#include <fstream>
#include <sstream>

#include "capture/error.h"

namespace lumigraft::capture {
namespace {

/// "12.345678901" to nanoseconds without rounding through a double. Empty if it is no such number.
std::optional<std::int64_t> parse_seconds(std::string_view text) {
  const std::size_t dot = text.find('.');
  const std::string_view seconds = text.substr(0, dot);
  std::string_view fraction = dot == std::string_view::npos ? std::string_view() : text.substr(dot + 1);
  std::int64_t time_ns = 0;
  if (seconds.empty() || seconds.size() > 10) return std::nullopt;
  fraction = fraction.substr(0, fraction.find_first_not_of("0123456789") == std::string_view::npos ? 9 : 0);
  if (dot != std::string_view::npos && fraction.empty()) return std::nullopt;
  for (const char c : seconds) {
    if (c < '0' || c > '9') return std::nullopt;
    time_ns = time_ns * 10 + (c - '0');
  }
  if (time_ns >= 4'000'000'000) {  // the year 2096
    return std::nullopt;
  }
  for (std::size_t i = 0; i < 9; ++i) time_ns = time_ns * 10 + (i < fraction.size() ? fraction[i] - '0' : 0);
  return time_ns;
}

}  // namespace

std::vector<ListedPicture> read_picture_list(const std::filesystem::path& list, const ListRules& rules) {
  std::error_code error;
  std::ifstream in(list);
  refuse_if(!in || !std::filesystem::is_regular_file(list, error),
            list.string() + ": found no readable file, allowed: a list of pictures");
  const std::string allowed = std::string(", allowed: \"timestamp_s path") + (rules.exposures ? " [exposure]\"" : "\"");
  std::vector<ListedPicture> pictures;
  int line_number = 0;
  const auto refuse = [&](const std::string& found, const std::string& wanted) {
    throw InputError(list.string() + ":" + std::to_string(line_number) + ": found " + found + wanted);
  };
  for (std::string line; std::getline(in, line);) {
    ++line_number;
    std::istringstream fields(line);
    std::vector<std::string> words;
    for (std::string word; fields >> word;) words.push_back(word);
    if (words.empty() || words[0][0] == '#') continue;
    if (words.size() < 2 || words.size() > (rules.exposures ? 3u : 2u)) {
      refuse(std::to_string(words.size()) + " columns", allowed);
    }
    const std::optional<std::int64_t> time_ns = parse_seconds(words[0]);
    if (!time_ns) refuse("a timestamp that is no plain number of seconds", allowed);
    ListedPicture picture{*time_ns, list.parent_path() / words[1], words[1], std::nullopt, line_number};
    if (words.size() == 3) {
      double value = 0.0;
      const char* end = words[2].data() + words[2].size();
      const auto [stop, code] = std::from_chars(words[2].data(), end, value);
      if (code != std::errc() || stop != end || !std::isfinite(value) || !(value > 0.0)) {
        refuse("an exposure that is no positive number", allowed);
      }
      picture.exposure = value;
    }
    if (!pictures.empty() && picture.time_ns < pictures.back().time_ns) {
      refuse("a timestamp before that of line " + std::to_string(pictures.back().line),
             ", allowed: timestamps that never go back");
    }
    if (!pictures.empty() && picture.time_ns == pictures.back().time_ns && !rules.brackets) {
      refuse("the timestamp of line " + std::to_string(pictures.back().line) + " again",
             ", allowed: timestamps that increase");
    }
    pictures.push_back(std::move(picture));
  }
  refuse_if(pictures.empty(), list.string() + ": found no picture in the list" + allowed);
  return pictures;
}

}  // namespace lumigraft::capture
