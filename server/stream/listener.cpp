#include "server/stream/listener.h"

#include <algorithm>
#include <boost/asio/ip/address.hpp>

namespace lumigraft::server {

const std::vector<std::string>& Permissions::all_names() {
  static const std::vector<std::string> names = {"view", "control", "record", "admin"};
  return names;
}

std::vector<std::string> Permissions::names() const {
  std::vector<std::string> mine;
  for (const std::string& name : all_names())
    if (has(named(name))) mine.push_back(name);
  return mine;
}

Permission Permissions::named(const std::string& name) {
  const auto at = std::ranges::find(all_names(), name) - all_names().begin();
  return static_cast<Permission>(1u << at);
}

bool ListenerSettings::local() const { return !socket.empty() || boost::asio::ip::make_address(address).is_loopback(); }

std::string ListenerSettings::url(std::uint16_t bound_port) const {
  if (!socket.empty()) return "unix:" + socket.string();
  const bool v6 = address.find(':') != std::string::npos;
  return std::string(encrypted() ? "https://" : "http://") + (v6 ? "[" + address + "]" : address) + ':' +
         std::to_string(bound_port) + '/';
}

}  // namespace lumigraft::server
