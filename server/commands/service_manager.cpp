#include "server/commands/service_manager.h"

#include <systemd/sd-daemon.h>

#include <utility>

namespace lumigraft::server {
namespace {

void tell(const std::string& what) { sd_notify(0, what.c_str()); }

}  // namespace

void ServiceManager::ready() {
  if (!std::exchange(ready_, true)) tell("READY=1");
}

void ServiceManager::tick(const std::string& hung, const std::string& status) {
  if (hung.empty()) tell("WATCHDOG=1");
  const std::string now = hung.empty() ? status : hung + " does not answer";
  if (now != std::exchange(last_, now)) tell("STATUS=" + now);
}

void ServiceManager::stopping() { tell("STOPPING=1"); }

}  // namespace lumigraft::server
