#include "capture/live/v4l2/stream.h"

#include <poll.h>
#include <sys/mman.h>

#include <algorithm>
#include <cerrno>
#include <cstring>
#include <thread>

#include "capture/error.h"
#include "capture/live/parameters.h"

namespace lumigraft::capture::v4l2 {
namespace {

struct Mapping {
  void* begin = MAP_FAILED;
  std::size_t size = 0;
};

void unmap(Mapping& mapping) {
  if (mapping.begin != MAP_FAILED) munmap(mapping.begin, mapping.size);
  mapping.begin = MAP_FAILED;
}

/// Replaces a driver mapping by anonymous memory with the same bytes at the same address, because the kernel keeps a
/// camera open while any of its memory is mapped. Atomic for readers, since mremap replaces the mapping in one step.
void replace_by_copy(const Mapping& mapping) {
  void* own = mmap(nullptr, mapping.size, PROT_READ | PROT_WRITE, MAP_PRIVATE | MAP_ANONYMOUS, -1, 0);
  if (own == MAP_FAILED) return;
  std::memcpy(own, mapping.begin, mapping.size);
  if (mremap(own, mapping.size, mapping.size, MREMAP_MAYMOVE | MREMAP_FIXED, mapping.begin) == MAP_FAILED) {
    munmap(own, mapping.size);
  }
}

v4l2_buffer buffer_of(const Device& device, int planes, std::array<v4l2_plane, VIDEO_MAX_PLANES>& memory) {
  v4l2_buffer buffer{};
  buffer.type = device.buffers();
  buffer.memory = V4L2_MEMORY_MMAP;
  if (device.multi_planar()) {
    memory = {};
    buffer.m.planes = memory.data();
    buffer.length = static_cast<__u32>(planes);
  }
  return buffer;
}

}  // namespace

struct Stream::Buffer {
  std::array<Mapping, 2> planes;
  bool lent = false;
};

/// State shared by the stream and the holders of lent buffers.
struct Stream::Shared {
  ~Shared() {
    for (Buffer& buffer : buffers) std::for_each(buffer.planes.begin(), buffer.planes.end(), unmap);
  }

  void queue(std::uint32_t index, int planes) {
    const std::lock_guard lock(mutex);
    buffers[index].lent = false;
    if (device) {
      std::array<v4l2_plane, VIDEO_MAX_PLANES> memory;
      v4l2_buffer buffer = buffer_of(*device, planes, memory);
      buffer.index = index;
      with_driver += device->call(VIDIOC_QBUF, &buffer) == 0 ? 1 : 0;  // dequeue() reports a camera that is gone
    }
  }

  std::mutex mutex;
  std::unique_ptr<Device> device;  ///< null after the stream has ended
  int with_driver = 0;             ///< number of buffers queued in the driver
  std::vector<Buffer> buffers;
};

Stream::Stream(std::unique_ptr<Device> device, int planes) : shared_(std::make_shared<Shared>()), planes_(planes) {
  shared_->device = std::move(device);
  const Device& camera = *shared_->device;
  v4l2_requestbuffers request{};
  request.count = kV4l2Parameters.buffers;
  request.type = camera.buffers();
  request.memory = V4L2_MEMORY_MMAP;
  camera.demand(VIDIOC_REQBUFS, &request, "buffers");
  for (std::uint32_t i = 0; i < request.count; ++i) {
    std::array<v4l2_plane, VIDEO_MAX_PLANES> memory;
    v4l2_buffer buffer = buffer_of(camera, planes, memory);
    buffer.index = i;
    camera.demand(VIDIOC_QUERYBUF, &buffer, "buffers");
    auto& mappings = shared_->buffers.emplace_back().planes;
    for (int p = 0; p < planes; ++p) {
      const auto n = static_cast<std::size_t>(p);
      mappings[n].size = camera.multi_planar() ? memory[n].length : buffer.length;
      const auto offset = static_cast<off_t>(camera.multi_planar() ? memory[n].m.mem_offset : buffer.m.offset);
      mappings[n].begin = mmap(nullptr, mappings[n].size, PROT_READ, MAP_SHARED, camera.descriptor(), offset);
      if (mappings[n].begin == MAP_FAILED) fail(errno, "buffers");
    }
    camera.demand(VIDIOC_QBUF, &buffer, "buffers");
    ++shared_->with_driver;
  }
  v4l2_event_subscription subscription{};
  subscription.type = V4L2_EVENT_SOURCE_CHANGE;
  int input = 0;
  if (camera.call(VIDIOC_G_INPUT, &input) == 0) subscription.id = static_cast<__u32>(input);  // events are per input
  camera.call(VIDIOC_SUBSCRIBE_EVENT, &subscription);  // fails for most cameras, which have no such event
  v4l2_buf_type type = camera.buffers();
  camera.demand(VIDIOC_STREAMON, &type, "start");
}

Stream::~Stream() {
  if (unplugged_) std::this_thread::sleep_for(kV4l2Parameters.unplug_delay);
  const std::lock_guard lock(shared_->mutex);
  v4l2_buf_type type = shared_->device->buffers();
  shared_->device->call(VIDIOC_STREAMOFF, &type);
  for (Buffer& buffer : shared_->buffers) {
    for (Mapping& mapping : buffer.planes) {
      if (!buffer.lent) {
        unmap(mapping);
      } else if (mapping.begin != MAP_FAILED) {
        replace_by_copy(mapping);
      }
    }
  }
  shared_->device.reset();
}

const Device& Stream::device() const { return *shared_->device; }

std::optional<FilledBuffer> Stream::next(std::chrono::milliseconds timeout) {
  if (!fault_.empty()) return std::nullopt;
  pollfd waiting{shared_->device->descriptor(), POLLIN | POLLPRI, 0};
  const int ready = poll(&waiting, 1, static_cast<int>(timeout.count()));
  if (ready <= 0) return std::nullopt;  // interruption by a signal counts as a timeout
  if ((waiting.revents & POLLPRI) != 0 && source_changed()) {
    fault_ = "the camera gives another format now";
    return std::nullopt;
  }
  return dequeue();
}

/// Whether an event reports a change of the signal.
bool Stream::source_changed() {
  v4l2_event event{};
  bool changed = false;
  while (shared_->device->call(VIDIOC_DQEVENT, &event) == 0) {
    changed = changed || event.type == V4L2_EVENT_SOURCE_CHANGE;
    event = {};
  }
  return changed;
}

std::optional<FilledBuffer> Stream::dequeue() {
  const Device& device = *shared_->device;
  std::array<v4l2_plane, VIDEO_MAX_PLANES> memory;
  v4l2_buffer buffer = buffer_of(device, planes_, memory);
  const int error = device.call(VIDIOC_DQBUF, &buffer);
  if (error == EAGAIN) return std::nullopt;
  if (error != 0 || buffer.index >= shared_->buffers.size()) {
    unplugged_ = error == ENODEV;
    try {
      fail(error, "the camera stopped");
    } catch (const InputError& e) {
      fault_ = unplugged_ ? "the camera is disconnected" : e.what();
    }
    return std::nullopt;
  }
  {
    const std::lock_guard lock(shared_->mutex);
    --shared_->with_driver;
  }
  FilledBuffer out{
      .index = buffer.index,
      .sequence = buffer.sequence,
      .time_ns = std::int64_t{buffer.timestamp.tv_sec} * 1'000'000'000 + std::int64_t{buffer.timestamp.tv_usec} * 1'000,
      .monotonic = (buffer.flags & V4L2_BUF_FLAG_TIMESTAMP_MASK) == V4L2_BUF_FLAG_TIMESTAMP_MONOTONIC,
      .damaged = (buffer.flags & V4L2_BUF_FLAG_ERROR) != 0,
      .planes = {}};
  for (int p = 0; p < planes_; ++p) {
    const auto n = static_cast<std::size_t>(p);
    const Mapping& mapping = shared_->buffers[buffer.index].planes[n];
    const std::size_t used = device.multi_planar() ? memory[n].bytesused : buffer.bytesused;
    const std::size_t skipped = device.multi_planar() ? std::min<std::size_t>(memory[n].data_offset, used) : 0;
    out.planes[n] = {static_cast<const std::uint8_t*>(mapping.begin) + std::min(skipped, mapping.size),
                     std::min(used, mapping.size) - std::min(skipped, mapping.size)};
  }
  return out;
}

void Stream::give_back(std::uint32_t index) { shared_->queue(index, planes_); }

std::shared_ptr<const void> Stream::lend(std::uint32_t index) {
  {
    const std::lock_guard lock(shared_->mutex);
    if (shared_->with_driver < kV4l2Parameters.min_buffers_with_driver) return nullptr;
    shared_->buffers[index].lent = true;
  }
  return {shared_->buffers[index].planes[0].begin,
          [shared = shared_, index, planes = planes_](const void*) { shared->queue(index, planes); }};
}

}  // namespace lumigraft::capture::v4l2
