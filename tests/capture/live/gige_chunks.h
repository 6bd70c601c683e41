#pragma once
// Chunks and a white balance for Aravis's camera of GigE Vision, which has none: features for its description of
// itself, and the packets of its pictures with chunks behind the pixels. Read by the real library; GigE Vision 2.0,
// chunk data and GVSP.
#include <arv.h>

#include <string>
#include <vector>

namespace lumigraft::test {

class GigeChunks {
 public:
  using Packets = std::vector<std::vector<gchar>>;

  /// `kind`: "chunks"; "chunks-appended", behind a picture that is no chunk itself; "chunks-alone", whose leaders say
  /// nothing of the picture; "chunks-ticks", with a clock of 125 MHz; "chunks-factor", whose gain is a factor and
  /// has no unit. Wrong in one picture of eight: "chunks-torn",
  /// with a length that is not its own; "chunks-short", with half a time; "chunks-missing", with none.
  explicit GigeChunks(std::string kind) : kind_(std::move(kind)) {}

  /// The camera's description of itself with their features. Empty where it is not the one that we know.
  std::string described(std::string xml) const;
  /// Tells the camera's clock.
  void set_up(ArvFakeCamera* camera) const;

  /// One picture's packets as the camera would send them with what is switched on. Of picture n the time is 7 ms before
  /// the leader's, with 500 + n mod 2 in its last three digits; the exposure is 2 + n mod 2 times, and the gain 6 dB
  /// more than what was set.
  Packets with_chunks(const Packets& plain, ArvFakeCamera* camera) const;

 private:
  std::string kind_;
};

}  // namespace lumigraft::test
