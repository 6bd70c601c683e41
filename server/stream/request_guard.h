#pragma once
// Which requests are answered at all, by where they say they go and come from.
#include <string_view>

namespace lumigraft::server {

/// Bound to loopback, only requests to a loopback name are answered: a foreign name that resolves to 127.0.0.1 is
/// another site's page reaching in (DNS rebinding). Everywhere, a request that names its origin must come from the
/// page of this very host and port. `origin` is empty where the request has none.
bool request_allowed(std::string_view host, std::string_view origin, bool bound_to_loopback);

}  // namespace lumigraft::server
