#pragma once
// Listeners of the configuration: server.listen, or [[server.listener]].
#include <string>
#include <vector>

#include "capture/session/config.h"
#include "server/stream/listener.h"

namespace lumigraft::server {

inline constexpr const char* kDefaultListen = "127.0.0.1:8080";

/// ADDRESS:PORT with a numeric address, [::1]:PORT, localhost:PORT, :PORT, or unix:PATH. Who reaches it may do all that
/// there is if it is local, else only view. `where` is the prefix of error messages. Throws InputError.
ListenerSettings listener_at(const std::string& text, const std::string& where);

/// Of the table [server], whose key `listen` is one listener and `listener` an array of them; kDefaultListen if it has
/// neither. Throws InputError.
std::vector<ListenerSettings> read_listeners(const capture::ConfigTable& server, int max_viewers);

/// Certificates that end soon, or have ended.
std::vector<std::string> certificate_warnings(const std::vector<ListenerSettings>& listeners);

/// What a person who set them should know: these, and tokens that travel unencrypted.
std::vector<std::string> listener_warnings(const std::vector<ListenerSettings>& listeners);

}  // namespace lumigraft::server
