#pragma once
// A file that replaces an older one in one step, also if the power fails meanwhile.
#include <cstdint>
#include <filesystem>
#include <span>

namespace lumigraft::reconstruct {

/// Writes FILE.partial; `commit` renames it when it is on the disk. Functions throw std::runtime_error with the reason.
class AtomicFile {
 public:
  explicit AtomicFile(std::filesystem::path file);
  ~AtomicFile();  ///< removes what was not committed
  AtomicFile(const AtomicFile&) = delete;
  AtomicFile& operator=(const AtomicFile&) = delete;

  void write(std::span<const std::uint8_t> bytes);
  void commit();
  std::uintmax_t size() const { return size_; }  ///< bytes so far

 private:
  [[noreturn]] void fail() const;

  std::filesystem::path file_, partial_;
  int descriptor_ = -1;
  std::uintmax_t size_ = 0;
};

}  // namespace lumigraft::reconstruct
