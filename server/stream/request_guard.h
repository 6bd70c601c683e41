#pragma once
// Decides by the Host and Origin headers whether a request is answered.
#include <string_view>

#include "server/stream/listener.h"

namespace lumigraft::server {

/// A name that resolves to an address of this machine is used by a page of another site to reach it (DNS rebinding). So
/// the Host must be one of `allowed_hosts`, or on loopback a loopback name or address, elsewhere any address, the name
/// of this machine or its .local name; on a Unix socket, which no page reaches, any. A request with an Origin header
/// must come from the page of this host and port, or from one of `allowed_origins`. `origin` is empty where the request
/// has none.
bool request_allowed(std::string_view host, std::string_view origin, const ListenerSettings& listener);

}  // namespace lumigraft::server
