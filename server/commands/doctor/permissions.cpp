#include "server/commands/doctor/permissions.h"

#include <fcntl.h>
#include <grp.h>
#include <pwd.h>
#include <sys/stat.h>
#include <unistd.h>

#include <algorithm>
#include <cerrno>
#include <cstring>
#include <vector>

namespace lumigraft::server {
namespace {

namespace fs = std::filesystem;

std::string user_name() {
  const passwd* const user = getpwuid(geteuid());
  return user ? user->pw_name : std::to_string(geteuid());
}

std::string group_name(gid_t group) {
  const ::group* const found = getgrgid(group);
  return found ? found->gr_name : std::to_string(group);
}

}  // namespace

std::string user_text() {
  std::vector<gid_t> groups(static_cast<std::size_t>(std::max(getgroups(0, nullptr), 0)));
  const int count = getgroups(static_cast<int>(groups.size()), groups.data());
  std::string text = user_name() + (count > 0 ? ", groups" : ", no groups");
  for (int i = 0; i < count; ++i) text += ' ' + group_name(groups[static_cast<std::size_t>(i)]);
  return text;
}

bool may_use(const fs::path& file) { return faccessat(AT_FDCWD, file.c_str(), R_OK | W_OK, AT_EACCESS) == 0; }

std::string mend_node(const fs::path& node) {
  struct stat found {};
  constexpr mode_t kGroup = S_IRGRP | S_IWGRP;
  if (stat(node.c_str(), &found) == 0 && (found.st_mode & kGroup) == kGroup && found.st_gid != 0)
    return "sudo usermod -aG " + group_name(found.st_gid) + ' ' + user_name() +
           ", then log in again (a service: SupplementaryGroups=" + group_name(found.st_gid) + " in its unit)";
  return "a file /etc/udev/rules.d/70-lumigraft.rules with the line KERNEL==\"" + node.filename().string() +
         "\", MODE=\"0660\", GROUP=\"video\"; then sudo udevadm control --reload && sudo udevadm trigger";
}

fs::path existing_part(fs::path folder) {
  std::error_code none;
  folder = fs::absolute(folder, none);
  while (!fs::exists(folder, none) && folder.has_relative_path()) folder = folder.parent_path();
  return folder;
}

std::string unwritable(const fs::path& folder) {
  const fs::path there = existing_part(folder);
  std::error_code none;
  if (!fs::is_directory(there, none)) return there.string() + " is no folder";
  if (faccessat(AT_FDCWD, there.c_str(), W_OK | X_OK, AT_EACCESS) == 0) return "";
  return there.string() + ": " + std::strerror(errno);
}

std::string mend_folder(const fs::path& folder) {
  return "sudo install -d -o " + user_name() + ' ' + folder.string() +
         ", or a folder in the configuration that this user may write";
}

}  // namespace lumigraft::server
