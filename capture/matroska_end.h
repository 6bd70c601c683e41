#pragma once
// Where a Matroska file ends in time, told by the heads of its elements: nothing of its pictures is read.
#include <cstdint>
#include <filesystem>
#include <optional>

namespace lumigraft {

/// The container's time of the last picture that is there as a whole, nanoseconds. Empty where only reading everything
/// would tell: clusters whose length nobody wrote, or no Matroska.
std::optional<std::int64_t> matroska_end_ns(const std::filesystem::path& file);

}  // namespace lumigraft
