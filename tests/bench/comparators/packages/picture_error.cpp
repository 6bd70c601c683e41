// picture_error SESSION FRAME PICTURE: the bench's measures of a picture that another program rendered, as JSON.
#include <chrono>
#include <iostream>
#include <memory>
#include <nlohmann/json.hpp>
#include <optional>
#include <string>

#include "capture/error.h"
#include "capture/formats/picture_file.h"
#include "capture/source.h"
#include "server/bench/bench_session.h"
#include "server/bench/measures.h"
#include "server/pipeline/camera_picture.h"
#include "server/truth/truth.h"

namespace {

using namespace lumigraft;

capture::Image<std::uint8_t> camera_picture_of(const capture::Session& session, std::uint64_t index) {
  const std::unique_ptr<capture::FrameReader> frames = capture::open_paired_frames(session);
  while (const std::optional<capture::FrameSet> frame = frames->next(std::chrono::seconds(10))) {
    if (frame->index == index) return server::camera_picture(*frame->color);
  }
  throw capture::InputError(session.folder.string() + ": no frame " + std::to_string(index));
}

void run(const std::string& folder, std::uint64_t index, const std::string& picture) {
  const server::ServiceInput input = server::open_bench_session(folder, {});
  const server::TruePictures truth =
      server::read_true_pictures(server::truth_folder(input.session.folder, index), input.session.color.exposure);
  const server::Measures measures =
      server::measure_picture(capture::read_encoded(picture), camera_picture_of(input.session, index), truth);
  std::cout << nlohmann::ordered_json{{"session", input.session.name},
                                      {"relight_error", measures.relight_error},
                                      {"object_error", measures.object_error},
                                      {"psnr", measures.psnr_db},
                                      {"psnr_affected", measures.psnr_affected_db},
                                      {"psnr_object", measures.psnr_object_db},
                                      {"psnr_relit", measures.psnr_relit_db},
                                      {"flip", measures.flip}}
            << '\n';
}

}  // namespace

int main(int argc, char** argv) {
  if (argc != 4) {
    std::cerr << "usage: picture_error SESSION FRAME PICTURE\n";
    return 2;
  }
  try {
    run(argv[1], std::stoull(argv[2]), argv[3]);
    return 0;
  } catch (const std::exception& e) {
    std::cerr << "picture_error: " << e.what() << '\n';
    return 1;
  }
}
