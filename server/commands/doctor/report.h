#pragma once
// Lines of `lumigraft doctor`: what was checked, what was found, and one action that mends it.
#include <ostream>
#include <string>

namespace lumigraft::server {

class DoctorReport {
 public:
  explicit DoctorReport(std::ostream& out) : out_(out) {}

  void ok(const std::string& what, const std::string& detail);
  /// What serve and replay do without. `mend` may be empty.
  void note(const std::string& what, const std::string& detail, const std::string& mend);
  void missing(const std::string& what, const std::string& reason, const std::string& mend);
  /// A line that decides nothing.
  void line(const std::string& text);
  /// Whether nothing is missing.
  bool good() const { return good_; }

 private:
  std::ostream& out_;
  bool good_ = true;
};

}  // namespace lumigraft::server
