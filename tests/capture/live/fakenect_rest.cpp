// What Debian's libfakenect, which plays recordings of libfreenect, does not have of libfreenect: registered depth,
// automatic exposure and serial numbers. Loaded before it.
#include <libfreenect.h>

#include <cstdio>
#include <cstdlib>

extern "C" {

freenect_frame_mode freenect_find_depth_mode(freenect_resolution resolution, freenect_depth_format format) {
  freenect_frame_mode mode{};
  mode.resolution = resolution;
  mode.depth_format = format;
  mode.width = 640;
  mode.height = 480;
  mode.bytes = 640 * 480 * 2;
  mode.is_valid = 1;
  return mode;
}

/// Appends "FLAG VALUE" to the file that LUMIGRAFT_FAKENECT_FLAGS names.
int freenect_set_flag(freenect_device* /*device*/, freenect_flag flag, freenect_flag_value value) {
  if (std::FILE* file = std::fopen(std::getenv("LUMIGRAFT_FAKENECT_FLAGS"), "a")) {
    std::fprintf(file, "%d %d\n", flag, value);
    std::fclose(file);
  }
  return 0;
}

int freenect_list_device_attributes(freenect_context* /*context*/, freenect_device_attributes** list) {
  static freenect_device_attributes one{nullptr, "A00000000000000A"};
  *list = &one;
  return 1;
}

void freenect_free_device_attributes(freenect_device_attributes* /*list*/) {}

}  // extern "C"
