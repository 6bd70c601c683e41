#pragma once
// Adds chunk data and white balance to Aravis's fake GigE Vision camera: features in its GenICam description, and
// chunks after the pixels in the packets of its frames (GigE Vision 2.0, chunk data and GVSP). Aravis itself reads
// them.
#include <arv.h>

#include <string>
#include <vector>

namespace lumigraft::test {

class GigeChunks {
 public:
  using Packets = std::vector<std::vector<gchar>>;

  /// `kind`: "chunks"; "chunks-appended", after an image that is no chunk itself; "chunks-alone", with leaders that do
  /// not describe the image; "chunks-ticks", with a clock of 125 MHz; "chunks-factor", with a gain that is a factor
  /// without unit. With a fault in one frame of eight: "chunks-torn", a wrong length; "chunks-short", half a time;
  /// "chunks-missing", no chunks; "chunks-impossible", an exposure
  /// that is not a number. "chunks-rolling" reads its rows in 18.5 ms, "chunks-global" has a global shutter;
  /// "chunks-automatic" has an automatic exposure that cannot be switched off.
  explicit GigeChunks(std::string kind) : kind_(std::move(kind)) {}

  /// The camera's GenICam description with the added features. Empty if the description is not the expected one.
  std::string described(std::string xml) const;
  /// Sets the frequency of the camera's clock.
  void set_up(ArvFakeCamera* camera) const;

  /// Packets of one frame with the enabled chunks. In frame n the time is 7 ms before the leader's and its last three
  /// digits are 500 + n mod 2; the exposure is 2 + n mod 2 times the one that was set, the gain 6 dB higher.
  Packets with_chunks(const Packets& plain, ArvFakeCamera* camera) const;

 private:
  std::string kind_;
};

}  // namespace lumigraft::test
