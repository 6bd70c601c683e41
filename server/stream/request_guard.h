#pragma once
// Decides by the Host and Origin headers whether a request is answered.
#include <string_view>

namespace lumigraft::server {

/// When bound to loopback, only requests to a loopback host name are answered: another name that resolves to 127.0.0.1
/// is used by a page of another site (DNS rebinding). On every address, a request with an Origin header must come from
/// the page of this host and port. `origin` is empty where the request has none.
bool request_allowed(std::string_view host, std::string_view origin, bool bound_to_loopback);

}  // namespace lumigraft::server
