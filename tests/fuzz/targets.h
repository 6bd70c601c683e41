#pragma once
// What is done with bytes that may be anything: read as what they claim to be, to the end. InputError and CameraFault
// are right answers; whatever else is thrown, crashes, hangs or fills the memory is a fault.
//
// libFuzzer makes the bytes, in a build of its own with clang:
//
//   cmake --preset fuzz && cmake --build --preset fuzz
//   build/fuzz/fuzz_mkv -max_total_time=600 -rss_limit_mb=1500 -max_len=20000 new_corpus tests/fuzz/corpus/mkv
//
//   tests/fuzz/openni_with_coverage.sh build/fuzz/openni
//   export LD_LIBRARY_PATH=build/fuzz/openni ASAN_OPTIONS=detect_leaks=0:allocator_may_return_null=1
//   flags="-fork=1 -ignore_crashes=1 -ignore_timeouts=1 -ignore_ooms=1 -timeout=10 -max_total_time=600"
//   build/fuzz/fuzz_oni_library $flags new_corpus tests/fuzz/corpus/oni
//
// and what it found, made small by -merge=1, is kept in corpus/ and read again by every run of the tests.
#include <cstdint>
#include <filesystem>
#include <span>

namespace lumigraft::fuzz {

using Bytes = std::span<const std::uint8_t>;

void mkv(Bytes bytes);          ///< a recording; its first byte says what it is taken for, and whether from a moment on
void session(Bytes bytes);      ///< a session.toml
void calibration(Bytes bytes);  ///< what a session.toml names as calibration
void oni(Bytes bytes);          ///< a recording of OpenNI2, in the program that reads it
/// The same in this process, so that libFuzzer sees into OpenNI2, where openni_with_coverage.sh built it. It crashes.
void oni_library(Bytes bytes);

/// A file in memory with these bytes; the same path each time.
std::filesystem::path file_with(Bytes bytes);

}  // namespace lumigraft::fuzz
