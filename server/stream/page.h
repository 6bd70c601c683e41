#pragma once
// The files of server/web, compiled into the program.
#include <string_view>

#include "server/stream/web_server.h"

namespace lumigraft::server {

/// The file of a request path; "/" is index.html. Status 404 where there is no such file.
WebReply page_reply(std::string_view path);

}  // namespace lumigraft::server
