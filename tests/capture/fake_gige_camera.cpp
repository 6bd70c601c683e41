// fake_gige_camera ADDRESS SERIAL LOST: Aravis's camera of GigE Vision on a loopback address, losing that share of its
// packets. Says "running" once it is, and runs until it is killed.
#include <arv.h>

#include <cstdio>
#include <cstdlib>

int main(int argc, char** argv) {
  if (argc != 4) {
    return 2;
  }
  ArvGvFakeCamera* camera = arv_gv_fake_camera_new(argv[1], argv[2]);
  g_object_set(camera, "gvsp-lost-ratio", std::atof(argv[3]), nullptr);
  if (!arv_gv_fake_camera_is_running(camera)) {
    return 1;
  }
  std::puts("running");
  std::fflush(stdout);
  for (;;) {
    g_usleep(1'000'000);
  }
}
