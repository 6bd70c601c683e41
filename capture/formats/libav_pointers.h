#pragma once
// Owning pointers to libav's objects. Included by .cpp files alone.
extern "C" {
#include <libavcodec/avcodec.h>
#include <libswscale/swscale.h>
}

#include <memory>

namespace lumigraft::capture {

struct FreeLibav {
  void operator()(AVCodecContext* p) const { avcodec_free_context(&p); }
  void operator()(AVFrame* p) const { av_frame_free(&p); }
  void operator()(AVPacket* p) const { av_packet_free(&p); }
  void operator()(SwsContext* p) const { sws_freeContext(p); }
};
using CodecContext = std::unique_ptr<AVCodecContext, FreeLibav>;
using LibavFrame = std::unique_ptr<AVFrame, FreeLibav>;
using LibavPacket = std::unique_ptr<AVPacket, FreeLibav>;
using LibavScaler = std::unique_ptr<SwsContext, FreeLibav>;

}  // namespace lumigraft::capture
