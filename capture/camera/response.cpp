#include "capture/camera/response.h"

#include <fstream>
#include <sstream>
#include <vector>

#include "capture/camera/srgb.h"
#include "capture/error.h"

namespace lumigraft::capture {

Response Response::srgb() {
  Response response;
  response.table_.fill(srgb_table().linear);
  return response;
}

Response Response::linear() {
  Response response;
  for (auto& channel : response.table_) {
    for (int code = 0; code < 256; ++code) channel[code] = static_cast<float>(code) / 255.0f;
  }
  return response;
}

Response Response::from_file(const std::filesystem::path& path) {
  const std::string allowed = ", allowed: 256 lines of one or three numbers from 0 to 1 that never decrease";
  std::ifstream in(path);
  refuse_if(!in, path.string() + ": found no readable file" + allowed);
  Response response;
  int code = 0;
  int line_number = 0;
  const auto refuse = [&](const std::string& found) {
    throw InputError(path.string() + ":" + std::to_string(line_number) + ": found " + found + allowed);
  };
  for (std::string line; std::getline(in, line);) {
    ++line_number;
    std::istringstream fields(line.substr(0, line.find('#')));
    std::vector<float> values;
    for (float value = 0; fields >> value;) values.push_back(value);
    fields.clear();
    std::string rest;
    if (fields >> rest) refuse("text that is no number");
    if (values.empty()) continue;
    if ((values.size() != 1 && values.size() != 3) || code == 256) {
      refuse(code == 256 ? "a 257th line" : std::to_string(values.size()) + " numbers");
    }
    for (int channel = 0; channel < 3; ++channel) {
      const float value = values[values.size() == 3 ? channel : 0];
      const bool in_range = value >= 0.0f && value <= 1.0f;  // false for NaN
      if (!in_range || (code > 0 && value < response.table_[channel][code - 1])) {
        refuse(std::to_string(value) + (in_range ? ", which decreases" : ""));
      }
      response.table_[channel][code] = value;
    }
    ++code;
  }
  refuse_if(code != 256, path.string() + ": found " + std::to_string(code) + " lines of values" + allowed);
  for (const auto& channel : response.table_) {
    refuse_if(!(channel[255] > channel[0]),
              path.string() + ": found a response that is the same for every code value" + allowed);
  }
  return response;
}

}  // namespace lumigraft::capture
