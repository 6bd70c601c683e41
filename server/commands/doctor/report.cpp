#include "server/commands/doctor/report.h"

namespace lumigraft::server {

void DoctorReport::ok(const std::string& what, const std::string& detail) { line(what + ": ok, " + detail); }

void DoctorReport::note(const std::string& what, const std::string& detail, const std::string& mend) {
  line(what + ": note, " + detail);
  if (!mend.empty()) line("  mend: " + mend);
}

void DoctorReport::missing(const std::string& what, const std::string& reason, const std::string& mend) {
  line(what + ": cannot be used: " + reason);
  if (!mend.empty()) line("  mend: " + mend);
  good_ = false;
}

void DoctorReport::line(const std::string& text) { out_ << "  " << text << '\n'; }

}  // namespace lumigraft::server
