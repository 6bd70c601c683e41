#pragma once
// Models that operators upload become part of the exhibit: the file is kept in models/ beside the exhibit's file, to
// which an [[object]] is appended. Then the exhibit is read again. They remove such models, too.
#include <cstdint>
#include <filesystem>
#include <functional>
#include <optional>
#include <string>
#include <string_view>
#include <variant>

#include "server/stream/web_server.h"

namespace lumigraft::server {

class ModelUpload {
 public:
  /// Reads the exhibit again and shows it. Throws what is wrong with it.
  using Reload = std::function<void()>;

  /// `exhibit`: empty if there is none. `min_free_gb` of its disk are left to others.
  ModelUpload(std::filesystem::path exhibit, double max_mb, double min_free_gb, Reload reload);

  /// As UploadHandlers::begin.
  std::variant<UploadHandlers::Place, WebReply> begin(std::string_view name, std::optional<std::uint64_t> bytes) const;
  /// As UploadHandlers::received: checks the model, keeps it and adds it to the exhibit; or leaves all as it was.
  WebReply received(const std::filesystem::path& file, std::string_view name) const;
  /// As UploadHandlers::remove: takes the objects that show the model out of the exhibit and deletes the file; or
  /// leaves all as it was.
  WebReply remove(std::string_view name) const;

 private:
  std::filesystem::path folder() const { return exhibit_.parent_path() / "models"; }

  std::filesystem::path exhibit_;
  std::uint64_t max_bytes_, min_free_bytes_;
  Reload reload_;
};

}  // namespace lumigraft::server
