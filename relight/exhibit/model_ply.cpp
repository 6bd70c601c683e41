#include "relight/exhibit/model_ply.h"

#include <fstream>
#include <iterator>
#include <sstream>
#include <string_view>

#include "capture/error.h"

namespace lumigraft::relight {

PlyFacts check_ply(const std::filesystem::path& file) {
  constexpr int max_header_lines = 10000;
  const std::string where = file.string() + ": not a model that can be read: ";
  PlyFacts facts;
  bool ascii = false, ended = false;
  std::size_t elements = 0;
  std::ifstream in(file, std::ios::binary);
  std::string line;
  for (int n = 0; n < max_header_lines && !ended && std::getline(in, line); ++n) {
    std::istringstream words(line);
    std::string keyword, second, third;
    words >> keyword >> second >> third;
    ended = keyword == "end_header";
    if (keyword == "format") ascii = second == "ascii";
    std::size_t count = 0;
    if (keyword == "element" && std::istringstream(third) >> count) elements += count;
    if (keyword == "property" && (third == "red" || third == "r" || third == "diffuse_red")) {
      facts.colors_are_8_bit = second == "uchar" || second == "uint8";
    }
  }
  if (!ended) throw capture::InputError(where + "found no end of the PLY header");
  if (!ascii) return facts;

  std::size_t lines = 0;
  while (std::getline(in, line)) lines += line.find_first_not_of(" \t\r") != std::string::npos;
  if (lines < elements) {
    throw capture::InputError(where + "found " + std::to_string(lines) + " lines of data, allowed: the " +
                              std::to_string(elements) + " of its header");
  }
  return facts;
}

std::string read_ply(const std::filesystem::path& file) {
  std::ifstream in(file, std::ios::binary);
  std::string bytes((std::istreambuf_iterator<char>(in)), std::istreambuf_iterator<char>());
  const std::size_t end = bytes.find("end_header"), data = bytes.find('\n', end) + 1;
  const std::size_t ascii = bytes.find("format ascii");
  if (end == std::string::npos || data == 0 || data >= bytes.size() || ascii < end) return bytes;
  if (std::string_view(" \t\r\n\f").find(bytes[data]) != std::string_view::npos) ++bytes[data];
  return bytes;
}

}  // namespace lumigraft::relight
