#pragma once
// Where the service listens, and what those who reach it there may do.
#include <cstdint>
#include <filesystem>
#include <initializer_list>
#include <string>
#include <vector>

namespace lumigraft::server {

enum class Permission : unsigned {
  view = 1,     ///< the page, pictures and their statistics
  control = 2,  ///< objects, and the playback of a recording
  record = 4,   ///< begin and end recordings
  admin = 8,    ///< figures of the service (/metrics), and to save the exhibit
};

/// A set of permissions.
class Permissions {
 public:
  constexpr Permissions() = default;
  constexpr Permissions(std::initializer_list<Permission> all) {
    for (const Permission one : all) bits_ |= static_cast<unsigned>(one);
  }
  static constexpr Permissions all() {
    return {Permission::view, Permission::control, Permission::record, Permission::admin};
  }
  constexpr bool has(Permission one) const { return (bits_ & static_cast<unsigned>(one)) != 0; }
  constexpr void add(Permission one) { bits_ |= static_cast<unsigned>(one); }
  constexpr bool operator==(const Permissions&) const = default;
  /// The words of the configuration, in order.
  std::vector<std::string> names() const;
  static const std::vector<std::string>& all_names();
  static Permission named(const std::string& name);  ///< of all_names()

 private:
  unsigned bits_ = 0;
};

struct ListenerSettings {
  std::string address = "127.0.0.1";  ///< numeric
  std::uint16_t port = 0;             ///< 0: any free one
  std::filesystem::path socket;       ///< a Unix socket in place of address and port; empty: none
  Permissions permissions = Permissions::all();
  /// Host names, without a port, and origins, as https://museum.example, that are accepted in addition to its own.
  std::vector<std::string> allowed_hosts, allowed_origins;
  int reserved_viewers = 0;                ///< of WebSettings::max_viewers, that other listeners can't take
  std::filesystem::path certificate, key;  ///< PEM files, for https; empty: http
  std::string token;                       ///< what viewers must know; empty: nothing

  bool encrypted() const { return !certificate.empty(); }
  /// Whether only programs of this machine reach it: a Unix socket, or the loopback interface.
  bool local() const;
  /// As https://[::1]:8080/ or unix:PATH.
  std::string url(std::uint16_t bound_port) const;
};

}  // namespace lumigraft::server
