#pragma once
// `lumigraft doctor`: what this machine offers and what is in the way.
#include <ostream>

namespace lumigraft::server {

/// Writes a report; true when everything that serve and replay need is there.
bool write_doctor_report(std::ostream& out);

}  // namespace lumigraft::server
