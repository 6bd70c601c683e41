#include "server/bench/shard.h"

#include <algorithm>
#include <charconv>
#include <numeric>

#include "capture/error.h"

namespace lumigraft::server {
namespace {

constexpr int kMaxShards = 1000000;

/// -1 where the text is not a whole number.
int whole_number(const std::string& text) {
  int value = 0;
  const auto [end, error] = std::from_chars(text.data(), text.data() + text.size(), value);
  return error == std::errc{} && end == text.data() + text.size() ? value : -1;
}

}  // namespace

Shard parse_shard(const std::string& text) {
  const std::size_t slash = text.find('/');
  Shard shard{-1, -1};
  if (slash != std::string::npos) shard = {whole_number(text.substr(0, slash)), whole_number(text.substr(slash + 1))};
  capture::refuse_if(shard.number < 1 || shard.number > shard.count || shard.count > kMaxShards,
                     "--shard: found \"" + text +
                         "\", allowed: K/N, the K-th of N parts, with K from 1 to N and N at most " +
                         std::to_string(kMaxShards));
  return shard;
}

std::vector<bool> rows_of(const Shard& shard, const std::vector<double>& costs) {
  const double whole = std::accumulate(costs.begin(), costs.end(), 0.0);
  std::vector<bool> chosen;
  double before = 0;
  for (const double cost : costs) {
    // The middle of a row decides: rows at the ends then exceed their part by half of their cost at most.
    const int part = std::min(static_cast<int>((before + cost / 2) / whole * shard.count), shard.count - 1);
    chosen.push_back(part == shard.number - 1);
    before += cost;
  }
  return chosen;
}

}  // namespace lumigraft::server
