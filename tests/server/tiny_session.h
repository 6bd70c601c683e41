#pragma once
// A session of a few small pictures without a tag: the minimum for the program to start, run and stop.
#include <filesystem>
#include <string>

namespace lumigraft::server {

struct TinySession {
  static constexpr int kWidth = 64, kHeight = 48, kFrames = 3;

  std::filesystem::path folder;

  explicit TinySession(const std::string& name);
  ~TinySession();
  TinySession(const TinySession&) = delete;
  TinySession& operator=(const TinySession&) = delete;

  void write(const std::string& file, const std::string& text) const;
  std::string read(const std::string& file) const;
  /// Replaces the first `from` in a file.
  void edit(const std::string& file, const std::string& from, const std::string& to) const;
};

}  // namespace lumigraft::server
