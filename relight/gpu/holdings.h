#pragma once
// Accounts for device memory in use, in bytes of texels and buffers as requested; devices may use more for alignment.
#include <cstddef>
#include <map>
#include <string>
#include <vector>

namespace lumigraft::relight::gpu {

/// All resources of one name.
struct Holding {
  std::string name;
  std::size_t count = 0, bytes = 0;
};

class Holdings {
 public:
  void add(const std::string& name, std::size_t bytes);
  void remove(const std::string& name, std::size_t bytes);

  std::size_t bytes() const { return bytes_; }
  std::size_t max_bytes() const { return max_bytes_; }  ///< maximum over time
  std::vector<Holding> list() const;                    ///< largest first

 private:
  std::map<std::string, Holding> by_name_;
  std::size_t bytes_ = 0, max_bytes_ = 0;
};

/// "1234 MB", in units of 10⁶ bytes.
std::string megabytes_text(std::size_t bytes);

}  // namespace lumigraft::relight::gpu
