#pragma once
// Writes all results of the bench as results.json.
#include <filesystem>

#include "server/bench/results.h"

namespace lumigraft::server {

/// Atomic: writes the whole file or none. Missing numbers are null.
void write_results_json(const std::filesystem::path& path, const BenchResults& results);

}  // namespace lumigraft::server
