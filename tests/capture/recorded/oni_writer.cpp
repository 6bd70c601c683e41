// oni_writer FILE FRAMES: records about FRAMES frames of each stream of the test device with OpenNI2's recorder,
// without mirroring. OpenNI2's recorder sometimes crashes or hangs.
#include <OpenNI.h>
#include <unistd.h>

#include <chrono>
#include <cstdlib>
#include <thread>

int main(int argc, char** argv) {
  constexpr unsigned kLongest_s = 5;
  alarm(kLongest_s);
  openni::OpenNI::initialize();
  openni::Device device;
  openni::VideoStream depth;
  openni::VideoStream color;
  openni::Recorder recorder;
  const bool ready = argc == 3 && device.open(openni::ANY_DEVICE) == openni::STATUS_OK &&
                     depth.create(device, openni::SENSOR_DEPTH) == openni::STATUS_OK &&
                     color.create(device, openni::SENSOR_COLOR) == openni::STATUS_OK &&
                     depth.setMirroringEnabled(false) == openni::STATUS_OK &&
                     color.setMirroringEnabled(false) == openni::STATUS_OK && depth.start() == openni::STATUS_OK &&
                     color.start() == openni::STATUS_OK && recorder.create(argv[1]) == openni::STATUS_OK &&
                     recorder.attach(depth, false) == openni::STATUS_OK &&
                     recorder.attach(color, false) == openni::STATUS_OK && recorder.start() == openni::STATUS_OK;
  if (!ready) {
    _exit(1);
  }
  constexpr int kOfAPicture_ms = 12;  // time per frame: the device runs faster than its nominal rate
  std::this_thread::sleep_for(std::chrono::milliseconds(kOfAPicture_ms * std::atoi(argv[2])));
  recorder.stop();
  recorder.destroy();
  _exit(0);
}
