#pragma once
// `lumigraft doctor`: checks what this machine supports, what is missing and what mends it.
#include <filesystem>
#include <ostream>

namespace lumigraft::server {

struct DoctorCommand {
  std::filesystem::path config;  ///< also checked, as serve would find it; empty: this machine alone
};

/// Writes a report; true when everything that serve and replay need is available.
bool write_doctor_report(const DoctorCommand& command, std::ostream& out);

}  // namespace lumigraft::server
