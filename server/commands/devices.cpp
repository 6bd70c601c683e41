#include "server/commands/devices.h"

#include <cmath>
#include <nlohmann/json.hpp>

namespace lumigraft::server {

void write_devices_text(std::ostream& out, const std::vector<capture::CameraListing>& cameras) {
  if (cameras.empty()) out << "no cameras found\n";
  for (const capture::CameraListing& camera : cameras) {
    out << camera.source << "  " << camera.name << '\n';
    for (const std::string& other : camera.same_hardware) out << "  the same hardware as " << other << '\n';
    if (!camera.rejection_reason.empty()) out << "  cannot be looked into: " << camera.rejection_reason << '\n';
    for (const capture::OfferedInput& input : camera.inputs) {
      out << "  input \"" << input.name << '"' << (input.chosen ? ", chosen" : "");
      out << (input.signal.empty() ? "" : ": ") << input.signal << '\n';
    }
    for (const capture::OfferedFormat& format : camera.formats) {
      out << "  " << format.pixels << ' ' << format.width << 'x' << format.height;
      if (format.rate_hz > 0.0) out << " at up to " << format.rate_hz << " Hz";
      out << '\n';
    }
    for (const capture::OfferedControl& control : camera.controls) {
      out << "  " << control.name << " = " << control.value;
      if (!std::isnan(control.low)) out << "  (" << control.low << " to " << control.high << ')';
      out << '\n';
    }
  }
}

void write_devices_json(std::ostream& out, const std::vector<capture::CameraListing>& cameras) {
  auto all = nlohmann::ordered_json::array();
  for (const capture::CameraListing& camera : cameras) {
    nlohmann::ordered_json one{{"source", camera.source},
                               {"name", camera.name},
                               {"formats", nlohmann::ordered_json::array()},
                               {"controls", nlohmann::ordered_json::array()}};
    for (const capture::OfferedFormat& f : camera.formats) {
      one["formats"].push_back(
          {{"pixel_format", f.pixels}, {"width", f.width}, {"height", f.height}, {"rate_hz", f.rate_hz}});
    }
    for (const capture::OfferedControl& c : camera.controls) {
      one["controls"].push_back({{"name", c.name}, {"low", c.low}, {"high", c.high}, {"value", c.value}});
    }
    for (const capture::OfferedInput& i : camera.inputs) {
      one["inputs"].push_back({{"name", i.name}, {"chosen", i.chosen}, {"signal", i.signal}});
    }
    if (!camera.same_hardware.empty()) one["same_hardware"] = camera.same_hardware;
    if (!camera.rejection_reason.empty()) one["why_not"] = camera.rejection_reason;
    all.push_back(std::move(one));
  }
  out << all.dump(2, ' ', false, nlohmann::ordered_json::error_handler_t::replace) << '\n';
}

}  // namespace lumigraft::server
