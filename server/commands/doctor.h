#pragma once
// `lumigraft doctor`: checks what this machine supports and what is missing.
#include <ostream>

namespace lumigraft::server {

/// Writes a report; true when everything that serve and replay need is available.
bool write_doctor_report(std::ostream& out);

}  // namespace lumigraft::server
