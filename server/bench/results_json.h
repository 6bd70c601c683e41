#pragma once
// Everything that the bench measured, as results.json.
#include <filesystem>

#include "server/bench/results.h"

namespace lumigraft::server {

/// Whole or not at all. Numbers that are not there are null.
void write_results_json(const std::filesystem::path& path, const BenchResults& results);

}  // namespace lumigraft::server
