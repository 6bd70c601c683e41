#include "reconstruct/albedo/albedo_warnings.h"

#include <algorithm>

#include "capture/message_text.h"
#include "reconstruct/albedo/parameters.h"

namespace lumigraft::reconstruct {
namespace {

std::string distance_warning(const std::vector<PointLight>& lights) {
  const auto unknown =
      std::count_if(lights.begin(), lights.end(), [](const PointLight& l) { return !l.distance_known; });
  if (unknown == 0) return "";
  return std::to_string(unknown) + (unknown == 1 ? " lamp is" : " lamps are") +
         " treated as infinitely distant: the room's shading does not determine the distance";
}

std::string guessed_distance_warning(const std::vector<PointLight>& lights) {
  const auto guessed = std::count_if(lights.begin(), lights.end(), [](const PointLight& l) {
    return l.distance_known && l.distance_log_sigma > kAlbedoParameters.stage.guess_log_sigma;
  });
  if (guessed == 0) return "";
  return "the distance of " + std::to_string(guessed) + (guessed == 1 ? " lamp" : " lamps") +
         " is a guess, of a usual height: the room's shading does not determine it";
}

std::string power_warning(const std::vector<PointLight>& lights) {
  const auto guessed = std::count_if(lights.begin(), lights.end(), [](const PointLight& l) {
    return l.power_log_sigma > kAlbedoParameters.stage.guess_log_sigma;
  });
  if (guessed == 0) return "";
  return "the power of " + std::to_string(guessed) + (guessed == 1 ? " clipped lamp" : " clipped lamps") +
         " is a guess: neither white paper nor shadows determine it, and albedo may be higher or lower than estimated";
}

std::string beam_warning(const std::vector<LampEstimate>& estimates) {
  const auto beams =
      std::count_if(estimates.begin(), estimates.end(), [](const LampEstimate& estimate) { return estimate.beam; });
  if (beams == 0) return "";
  return std::to_string(beams) + (beams == 1 ? " lamp emits a beam: it is" : " lamps emit beams: they are") +
         " rendered as a panel and may be farther away; a tag on it would determine its distance";
}

}  // namespace

std::vector<std::string> lamp_warnings(const std::vector<PointLight>& lamps,
                                       const std::vector<LampEstimate>& estimates) {
  std::vector<std::string> warnings = {distance_warning(lamps), guessed_distance_warning(lamps),
                                       beam_warning(estimates), power_warning(lamps)};
  std::erase(warnings, "");
  return warnings;
}

std::string extrinsics_warning(const ExtrinsicsError& error) {
  return capture::formatted(
      "T_tag_fisheye is wrong: rotated by about %.0f degrees and moved by about %.0f cm the fish-eye would agree with "
      "the colour camera",
      error.turn_degrees, 100 * error.shift_m);
}

}  // namespace lumigraft::reconstruct
