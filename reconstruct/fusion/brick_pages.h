#pragma once
// Memory of published bricks. Hundreds come and go with every publication: here one takes the place of another without
// the general allocator's search, in huge pages.
#include <cstddef>
#include <cstdlib>
#include <memory>
#include <mutex>
#include <vector>

#include "reconstruct/field/distance_field.h"

namespace lumigraft::reconstruct {

/// Places of one size for one kind of thing. Threads that drop a field give places back while another publishes.
class BrickPages {
 public:
  explicit BrickPages(std::size_t place_bytes);
  BrickPages(const BrickPages&) = delete;
  BrickPages& operator=(const BrickPages&) = delete;

  void* take();
  void give_back(void* place);

 private:
  struct Free {
    void operator()(void* chunk) const { std::free(chunk); }
  };
  std::size_t place_bytes_;
  std::mutex mutex_;
  std::vector<std::unique_ptr<void, Free>> chunks_;
  std::vector<void*> free_;  ///< the one last in use at the end: it may still be in the cache
};

/// Makes copies of bricks that share them; what it made may outlive it.
class FieldBrickMaker {
 public:
  FieldBrickMaker();
  std::shared_ptr<const FieldBrick> copy(const FieldBrick& brick) const;

 private:
  std::shared_ptr<BrickPages> pages_;
};

}  // namespace lumigraft::reconstruct
