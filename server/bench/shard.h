#pragma once
// One of N parts of the bench's rows, so that several machines measure one table.
#include <string>
#include <vector>

namespace lumigraft::server {

struct Shard {
  int number = 1, count = 1;  ///< from 1 to count
};

/// "K/N". Throws InputError.
Shard parse_shard(const std::string& text);

/// Of rows with these costs, in their order: whether each belongs to the shard. The N shards are disjoint and complete;
/// each is a range of rows, so that few sessions are reconstructed for more than one shard, and the costs of two shards
/// differ by at most two rows.
std::vector<bool> rows_of(const Shard& shard, const std::vector<double>& costs);

}  // namespace lumigraft::server
