#include "server/commands/service_manager.h"

#include <systemd/sd-daemon.h>

#include <utility>

namespace lumigraft::server {
namespace {

void notify(const std::string& state) { sd_notify(0, state.c_str()); }

}  // namespace

void ServiceManager::ready() {
  if (!std::exchange(ready_, true)) notify("READY=1");
}

void ServiceManager::tick(const std::string& hung, const std::string& status) {
  if (hung.empty()) notify("WATCHDOG=1");
  const std::string now = hung.empty() ? status : hung + " hangs";
  if (now != std::exchange(last_, now)) notify("STATUS=" + now);
}

void ServiceManager::stopping() { notify("STOPPING=1"); }

}  // namespace lumigraft::server
