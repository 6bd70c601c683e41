#include "server/stream/protocol.h"

#include <algorithm>
#include <cmath>
#include <map>
#include <nlohmann/json.hpp>

#include "server/stream/parameters.h"

namespace lumigraft::server {
namespace {

constexpr std::array<std::uint8_t, 4> kMagic{'L', 'U', 'M', 'I'};

template <typename T>
void put(std::vector<std::uint8_t>& out, std::size_t offset, T value) {
  for (std::size_t i = 0; i < sizeof(T); ++i) {
    out[offset + i] = static_cast<std::uint8_t>(static_cast<std::uint64_t>(value) >> (8 * i));
  }
}

struct Refused {
  std::string error;
};

double number(const nlohmann::json& value, const std::string& key, double low, double high) {
  if (!value.is_number() || !std::isfinite(value.get<double>()) || value.get<double>() < low ||
      value.get<double>() > high) {
    throw Refused{key + ": a number from " + std::to_string(low) + " to " + std::to_string(high)};
  }
  return value.get<double>();
}

template <int N>
Eigen::Matrix<double, N, 1> vector(const nlohmann::json& value, const std::string& key, double low, double high) {
  if (!value.is_array() || value.size() != N) throw Refused{key + ": an array of " + std::to_string(N) + " numbers"};
  Eigen::Matrix<double, N, 1> result;
  for (int i = 0; i < N; ++i) result[i] = number(value[static_cast<std::size_t>(i)], key, low, high);
  return result;
}

std::optional<float> number_or_null(const nlohmann::json& value, const std::string& key, double low, double high) {
  return value.is_null() ? std::nullopt : std::optional(static_cast<float>(number(value, key, low, high)));
}

std::optional<float> unit_or_null(const nlohmann::json& value, const std::string& key) {
  return number_or_null(value, key, 0, 1);
}

std::optional<Eigen::Vector3f> color_or_null(const nlohmann::json& value, const std::string& key, double high) {
  if (value.is_null()) return std::nullopt;
  return vector<3>(value, key, 0, high).cast<float>();
}

MaterialChange material(const nlohmann::json& value) {
  MaterialChange change;
  if (value.is_null()) {
    change.models_own = true;
    return change;
  }
  if (!value.is_object()) throw Refused{"material: null or an object"};
  for (const auto& [key, v] : value.items()) {
    if (key == "base_color") {
      change.base_color = color_or_null(v, key, 1);
    } else if (key == "emission") {
      change.emission = color_or_null(v, key, relight::kMaxEmission);
    } else if (key == "metallic") {
      change.metallic = unit_or_null(v, key);
    } else if (key == "roughness") {
      change.roughness = unit_or_null(v, key);
    } else if (key == "specular") {
      change.specular = unit_or_null(v, key);
    } else if (key == "transmission") {
      change.transmission = unit_or_null(v, key);
    } else if (key == "ior") {
      change.ior = number_or_null(v, key, 1, relight::kMaxIor);
    } else if (key == "thin_walled") {
      if (!v.is_null() && !v.is_boolean()) throw Refused{"thin_walled: true, false or null"};
      change.thin_walled = v.is_null() ? std::optional<bool>() : std::optional(v.get<bool>());
    } else if (key == "attenuation_color") {
      change.attenuation_color = color_or_null(v, key, 1);
    } else if (key == "attenuation_distance_m") {
      change.attenuation_distance_m =
          number_or_null(v, key, relight::kMinAttenuationDistance_m, relight::kMaxAttenuationDistance_m);
    } else if (key == "clearcoat") {
      change.clearcoat = unit_or_null(v, key);
    } else if (key == "clearcoat_roughness") {
      change.clearcoat_roughness = unit_or_null(v, key);
    } else {
      throw Refused{
          "material: base_color, metallic, roughness, specular, emission, transmission, ior, thin_walled, "
          "attenuation_color, attenuation_distance_m, clearcoat, clearcoat_roughness"};
    }
  }
  return change;
}

std::string name(const nlohmann::json& value) {
  if (!value.is_string() || value.get_ref<const std::string&>().size() > kStream.max_name_bytes)
    throw Refused{"name: a text of at most " + std::to_string(kStream.max_name_bytes) + " bytes"};
  return value.get<std::string>();
}

AnimationChange animation(const nlohmann::json& value) {
  if (!value.is_object()) throw Refused{"animation: an object"};
  AnimationChange change;
  for (const auto& [key, v] : value.items()) {
    if (key == "name") {
      change.name = name(v);
    } else if (key == "playing" && v.is_boolean()) {
      change.playing = v.get<bool>();
    } else if (key == "loop" && v.is_boolean()) {
      change.loop = v.get<bool>();
    } else if (key == "at_s") {
      change.at_s = number(v, key, 0, kStream.max_at_s);
    } else {
      throw Refused{"animation: name, playing and loop true or false, at_s in seconds"};
    }
  }
  return change;
}

ObjectCommand object(const nlohmann::json& message) {
  ObjectCommand command;
  bool named = false;
  for (const auto& [key, value] : message.items()) {
    if (key == "type") continue;
    if (key == "index") {
      command.object = static_cast<std::size_t>(number(value, key, 0, 1e6));
      named = true;
    } else if (key == "name") {
      command.object = name(value);
      named = true;
    } else if (key == "position_m") {
      command.position_m = vector<3>(value, key, -kStream.max_position_m, kStream.max_position_m);
    } else if (key == "on_pixel") {
      command.on_pixel = vector<2>(value, key, 0, kStream.max_pixel);
    } else if (key == "rotation_wxyz") {
      const auto q = vector<4>(value, key, -1e3, 1e3);
      if (q.norm() < 1e-6) throw Refused{"rotation_wxyz: a quaternion other than zero"};
      command.rotation = Eigen::Quaterniond(q[0], q[1], q[2], q[3]).normalized();
    } else if (key == "yaw_degrees") {
      command.yaw_degrees = number(value, key, -36000, 36000);
    } else if (key == "visible") {
      if (!value.is_boolean()) throw Refused{"visible: true or false"};
      command.visible = value.get<bool>();
    } else if (key == "reset") {
      if (!value.is_boolean() || !value.get<bool>()) throw Refused{"reset: true"};
      command.reset = true;
    } else if (key == "material") {
      command.material = material(value);
    } else if (key == "animation") {
      command.animation = animation(value);
    } else if (key == "variant") {
      if (!value.is_null() && !value.is_string()) throw Refused{"variant: a name, or null for the default materials"};
      command.variant.emplace();
      if (value.is_string()) *command.variant = name(value);
    } else {
      throw Refused{
          "object: index or name, position_m or on_pixel, rotation_wxyz or yaw_degrees, visible, reset, material, "
          "animation, variant"};
    }
  }
  if (!named) throw Refused{"object: index or name must be there"};
  if (command.rotation && command.yaw_degrees) throw Refused{"object: rotation_wxyz or yaw_degrees, not both"};
  if (command.position_m && command.on_pixel) throw Refused{"object: position_m or on_pixel, not both"};
  return command;
}

PlaybackCommand playback(const nlohmann::json& message) {
  PlaybackCommand command;
  for (const auto& [key, value] : message.items()) {
    if (key == "at_s") {
      command.at_s = number(value, key, 0, kStream.max_at_s);
    } else if (key == "paused" && value.is_boolean()) {
      command.paused = value.get<bool>();
    } else if (key == "step" && value.is_boolean()) {
      command.step = value.get<bool>();
    } else if (key != "type") {
      throw Refused{"playback: at_s in seconds, paused and step true or false"};
    }
  }
  return command;
}

Command parse(const nlohmann::json& message) {
  if (!message.is_object() || !message.contains("type") || !message["type"].is_string()) {
    throw Refused{"a message is a JSON object with a text \"type\""};
  }
  const std::string& type = message["type"].get_ref<const std::string&>();
  if (type == "want") {
    static const std::map<std::string, Codec> codecs = {
        {"h264", Codec::h264}, {"jpeg", Codec::jpeg}, {"none", Codec::none}};
    const std::string name = message.value("codec", nlohmann::json()).is_string() ? message["codec"] : "";
    const auto codec = codecs.find(name);
    if (codec == codecs.end()) throw Refused{"codec: h264, jpeg or none"};
    static const std::map<std::string, std::optional<StreamSize>> sizes = {
        {"auto", std::nullopt}, {"full", StreamSize::full}, {"half", StreamSize::half}};
    const nlohmann::json asked = message.value("size", nlohmann::json("auto"));
    const auto size = sizes.find(asked.is_string() ? asked.get<std::string>() : "");
    if (size == sizes.end()) throw Refused{"size: auto, full or half"};
    return WantCommand{codec->second, size->second};
  }
  if (type == "key") return KeyCommand{};
  if (type == "ack") {
    return AckCommand{
        static_cast<std::uint32_t>(number(message.value("sequence", nlohmann::json()), "sequence", 0, 4294967295.0))};
  }
  if (type == "object") return object(message);
  if (type == "record") {
    if (!message.contains("on") || !message["on"].is_boolean()) throw Refused{"on: true or false"};
    return RecordCommandOfViewer{message["on"].get<bool>()};
  }
  if (type == "playback") return playback(message);
  if (type == "save") return SaveCommand{};
  throw Refused{"type: want, object, record, playback, save, key or ack"};
}

}  // namespace

std::shared_ptr<const StreamMessage> make_stream_message(const StreamHeader& header,
                                                         std::span<const std::uint8_t> payload, StreamSize size,
                                                         std::chrono::steady_clock::time_point captured) {
  auto message = std::make_shared<StreamMessage>();
  message->header = header;
  message->captured = captured;
  message->size = size;
  std::vector<std::uint8_t>& out = message->bytes;
  out.resize(kStreamHeaderBytes + payload.size());
  std::copy(kMagic.begin(), kMagic.end(), out.begin());
  put(out, 4, static_cast<std::uint8_t>(kProtocolVersion));
  put(out, 5, static_cast<std::uint8_t>(header.kind));
  put(out, 6, header.flags);
  put(out, 8, header.sequence);
  put(out, 12, header.width);
  put(out, 14, header.height);
  put(out, 16, header.capture_time_ns);
  put(out, 24, header.send_time_ns);
  std::copy(payload.begin(), payload.end(), out.begin() + kStreamHeaderBytes);
  return message;
}

Command parse_command(std::string_view text) {
  const nlohmann::json message = nlohmann::json::parse(text, nullptr, /*allow_exceptions=*/false);
  if (message.is_discarded()) return BadCommand{"not JSON"};
  try {
    return parse(message);
  } catch (const Refused& refused) {
    return BadCommand{refused.error};
  } catch (const nlohmann::json::exception& e) {
    return BadCommand{e.what()};
  }
}

std::string error_message(std::string_view error) {
  return nlohmann::json{{"type", "error"}, {"error", error}}.dump(-1, ' ', false,
                                                                  nlohmann::json::error_handler_t::replace);
}

std::string saved_message(std::string_view error) { return nlohmann::json{{"type", "saved"}, {"error", error}}.dump(); }

}  // namespace lumigraft::server
