#pragma once
// Fuzz targets: each reads arbitrary bytes as one kind of input, to the end. InputError and CameraFault are correct
// results; any other exception, a crash, a hang or exhausted memory is a fault.
//
// libFuzzer generates the bytes, in a build of its own with clang (Debian: clang, libclang-rt-14-dev):
//
//   cmake --preset fuzz && cmake --build --preset fuzz
//   build/fuzz/fuzz_mkv -max_total_time=600 -rss_limit_mb=1500 -max_len=20000 new_corpus tests/fuzz/corpus/mkv
//
//   build/fuzz/fuzz_gltf -max_total_time=600 -rss_limit_mb=1500 -max_len=20000 new_corpus tests/fuzz/corpus/gltf
//
// and likewise for the others; make_seeds.py writes the first inputs of most of them.
//
//   tests/fuzz/openni_with_coverage.sh build/fuzz/openni
//   export LD_LIBRARY_PATH=build/fuzz/openni ASAN_OPTIONS=detect_leaks=0:allocator_may_return_null=1
//   flags="-fork=1 -ignore_crashes=1 -ignore_timeouts=1 -ignore_ooms=1 -timeout=10 -max_total_time=600"
//   build/fuzz/fuzz_oni_library $flags new_corpus tests/fuzz/corpus/oni
//
// The inputs it found, reduced by -merge=1, are kept in corpus/ and read again by every run of the tests.
#include <cstdint>
#include <filesystem>
#include <span>

namespace lumigraft::fuzz {

using Bytes = std::span<const std::uint8_t>;

void mkv(Bytes bytes);           ///< a Matroska recording; the first byte selects the stream and the seek time
void session(Bytes bytes);       ///< a session.toml
void calibration(Bytes bytes);   ///< the calibration file of a session.toml
void gltf(Bytes bytes);          ///< a model, .gltf or .glb
void ply(Bytes bytes);           ///< a model, .ply
void obj(Bytes bytes);           ///< a model, .obj
void picture(Bytes bytes);       ///< of a texture, whole and scaled down
void picture_list(Bytes bytes);  ///< the list of a recording's pictures, as of TUM; the first byte selects the rules
void response(Bytes bytes);      ///< the response table of a camera
void exhibit(Bytes bytes);       ///< an exhibit.toml
void service(Bytes bytes);       ///< a configuration of the service
void command(Bytes bytes);       ///< a viewer's command, the text of a websocket message
void http(Bytes bytes);          ///< what a client sends to the service's port
void websocket(Bytes bytes);     ///< what a client sends to it after the handshake of a websocket
void oni(Bytes bytes);           ///< a recording of OpenNI2, read by the helper program
/// The same in this process, so that libFuzzer measures coverage of OpenNI2 as built by openni_with_coverage.sh.
/// OpenNI2 may crash.
void oni_library(Bytes bytes);

/// A file in memory with these bytes; the same path each time.
std::filesystem::path file_with(Bytes bytes);

}  // namespace lumigraft::fuzz
