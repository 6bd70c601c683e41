#pragma once
// Map from brick keys to immutable bricks. Copies share clusters of 4³ bricks until one of them changes a cluster, so
// that publishing a field costs time for what changed, not for the whole room.
#include <algorithm>
#include <array>
#include <cstdint>
#include <memory>
#include <stdexcept>
#include <unordered_map>
#include <utility>
#include <vector>

namespace lumigraft::reconstruct {

struct BrickKeyHash {
  template <typename Integer>
  std::size_t operator()(const std::array<Integer, 3>& k) const {
    return static_cast<std::size_t>(k[0]) * 73856093u ^ static_cast<std::size_t>(k[1]) * 19349663u ^
           static_cast<std::size_t>(k[2]) * 83492791u;  // Teschner et al. 2003
  }
};
using BrickKey = std::array<int, 3>;

/// With the interface of std::unordered_map as far as it is needed. The order of iteration depends on the order of
/// changes alone.
template <typename Brick>
class BrickMap {
  struct Cluster {
    static constexpr int kBits = 2;                                // of a key that select the brick in its cluster
    std::array<std::uint8_t, std::size_t{1} << 3 * kBits> slot{};  ///< index in `entries` + 1; 0 = no such brick
    std::vector<std::pair<BrickKey, std::shared_ptr<const Brick>>> entries;
  };
  using Clusters = std::unordered_map<BrickKey, std::shared_ptr<Cluster>, BrickKeyHash>;

 public:
  using Value = std::shared_ptr<const Brick>;
  using value_type = std::pair<BrickKey, Value>;

  class const_iterator {
   public:
    using iterator_category = std::forward_iterator_tag;
    using value_type = BrickMap::value_type;
    using difference_type = std::ptrdiff_t;
    using pointer = const value_type*;
    using reference = const value_type&;

    const_iterator() = default;
    reference operator*() const { return cluster_->second->entries[index_]; }
    pointer operator->() const { return &**this; }
    const_iterator& operator++() {
      if (++index_ == cluster_->second->entries.size()) {
        ++cluster_;
        index_ = 0;
      }
      return *this;
    }
    const_iterator operator++(int) {
      const const_iterator before = *this;
      ++*this;
      return before;
    }
    bool operator==(const const_iterator&) const = default;

   private:
    friend BrickMap;
    const_iterator(typename Clusters::const_iterator cluster, std::size_t index) : cluster_(cluster), index_(index) {}
    typename Clusters::const_iterator cluster_;
    std::size_t index_ = 0;
  };

  const_iterator begin() const { return {clusters_.begin(), 0}; }
  const_iterator end() const { return {clusters_.end(), 0}; }
  std::size_t size() const { return size_; }
  bool empty() const { return size_ == 0; }

  const_iterator find(const BrickKey& key) const {
    const auto cluster = clusters_.find(cluster_of(key));
    if (cluster == clusters_.end()) return end();
    const std::uint8_t slot = cluster->second->slot[place_in_cluster(key)];
    return slot == 0 ? end() : const_iterator(cluster, slot - std::size_t{1});
  }
  bool contains(const BrickKey& key) const { return find(key) != end(); }
  const Value& at(const BrickKey& key) const {
    const auto found = find(key);
    if (found == end()) throw std::out_of_range("no such brick");
    return found->second;
  }

  Value& operator[](const BrickKey& key) {
    Cluster& cluster = own_cluster(key);
    std::uint8_t& slot = cluster.slot[place_in_cluster(key)];
    if (slot == 0) {
      cluster.entries.emplace_back(key, nullptr);
      slot = static_cast<std::uint8_t>(cluster.entries.size());
      ++size_;
    }
    return cluster.entries[slot - std::size_t{1}].second;
  }
  /// Keeps a brick that is there.
  void emplace(const BrickKey& key, Value brick) {
    if (!contains(key)) (*this)[key] = std::move(brick);
  }
  void erase(const BrickKey& key) {
    if (!contains(key)) return;
    Cluster& cluster = own_cluster(key);
    const std::uint8_t slot = std::exchange(cluster.slot[place_in_cluster(key)], std::uint8_t{0});
    if (slot != cluster.entries.size()) {
      cluster.entries[slot - std::size_t{1}] = std::move(cluster.entries.back());
      cluster.slot[place_in_cluster(cluster.entries[slot - std::size_t{1}].first)] = slot;
    }
    cluster.entries.pop_back();
    --size_;
    if (cluster.entries.empty()) clusters_.erase(cluster_of(key));
  }
  void clear() {
    clusters_.clear();
    size_ = 0;
  }

 private:
  static BrickKey cluster_of(const BrickKey& key) {
    return {key[0] >> Cluster::kBits, key[1] >> Cluster::kBits, key[2] >> Cluster::kBits};
  }
  static std::size_t place_in_cluster(const BrickKey& key) {
    constexpr int kMask = (1 << Cluster::kBits) - 1;
    return static_cast<std::size_t>((key[0] & kMask) | (key[1] & kMask) << Cluster::kBits |
                                    (key[2] & kMask) << 2 * Cluster::kBits);
  }
  /// The cluster of a brick, created if there is none, copied if other maps share it.
  Cluster& own_cluster(const BrickKey& key) {
    std::shared_ptr<Cluster>& cluster = clusters_[cluster_of(key)];
    if (!cluster)
      cluster = std::make_shared<Cluster>();
    else if (cluster.use_count() > 1)
      cluster = std::make_shared<Cluster>(*cluster);
    return *cluster;
  }

  Clusters clusters_;  ///< none is empty
  std::size_t size_ = 0;
};

/// In ascending order, which unlike the map's does not depend on hashing.
template <typename Brick>
std::vector<BrickKey> sorted_keys(const BrickMap<Brick>& bricks) {
  std::vector<BrickKey> keys;
  keys.reserve(bricks.size());
  for (const auto& [key, brick] : bricks) keys.push_back(key);
  std::sort(keys.begin(), keys.end());
  return keys;
}

}  // namespace lumigraft::reconstruct
