#include "server/commands/doctor/doctor.h"

#include <arpa/inet.h>
#include <gtest/gtest.h>
#include <sys/socket.h>
#include <unistd.h>

#include <cstdio>
#include <sstream>
#include <utility>

#include "capture/descriptor.h"
#include "relight/gpu/device.h"
#include "server/commands/doctor/machine_checks.h"
#include "tests/server/tiny_session.h"

namespace lumigraft::server {
namespace {

TEST(Doctor, EveryDeviceHasALineAndOneDraws) {
  std::ostringstream out;
  EXPECT_TRUE(write_doctor_report({}, out)) << out.str();
  for (const relight::gpu::DeviceListing& device : relight::gpu::list_devices()) {
    const std::string line = "  " + std::string(relight::gpu::name_of(device.backend)) + ": " + device.name + ": ";
    EXPECT_NE(out.str().find(line + (device.rejection_reason.empty() ? "ok, " : "cannot be used: ")), std::string::npos)
        << out.str();
  }
  const std::string draws =
      "  GPU: ok, " + std::string(relight::gpu::name_of(relight::gpu::best_backend())) + " draws unless";
  EXPECT_NE(out.str().find(draws), std::string::npos) << out.str();
}

/// What a command of the shell prints, and whether it succeeds.
std::pair<std::string, bool> said_by(const std::string& command) {
  FILE* const pipe = popen((command + " 2>&1").c_str(), "r");
  std::string text;
  for (int c = fgetc(pipe); c != EOF; c = fgetc(pipe)) text += static_cast<char>(c);
  return {text, pclose(pipe) == 0};
}

/// The program's report with these environment variables, and whether it succeeds.
std::pair<std::string, bool> doctor_with(const std::string& variables, const std::string& options = "") {
  return said_by("env " + variables + " " LUMIGRAFT_PROGRAM " doctor " + options);
}

// The variables hide the drivers from the loaders, as if not installed.
TEST(Doctor, SaysWhatIsMissingAndWhy) {
  const std::string no_vulkan = "VK_ICD_FILENAMES=/nowhere.json", no_egl = "__EGL_VENDOR_LIBRARY_FILENAMES=/nowhere";
  const std::string vulkan_line = "vulkan: Vulkan: cannot be used: no Vulkan device: no driver is installed",
                    egl_line = "egl: EGL: cannot be used: no EGL device";
  {
    const auto [text, good] = doctor_with(no_vulkan);
    EXPECT_TRUE(good) << text;
    EXPECT_NE(text.find(vulkan_line), std::string::npos) << text;
    EXPECT_NE(text.find("; VK_ICD_FILENAMES is /nowhere.json\n"), std::string::npos) << text;
    EXPECT_NE(text.find("GPU: ok, egl draws"), std::string::npos) << text;
  }
  {
    const auto [text, good] = doctor_with(no_egl);
    EXPECT_TRUE(good) << text;
    EXPECT_NE(text.find(egl_line), std::string::npos) << text;
    EXPECT_NE(text.find("GPU: ok, vulkan draws"), std::string::npos) << text;
  }
  const auto [text, good] = doctor_with(no_vulkan + " " + no_egl);
  EXPECT_FALSE(good) << text;
  EXPECT_NE(text.find(vulkan_line), std::string::npos) << text;
  EXPECT_NE(text.find(egl_line), std::string::npos) << text;
  EXPECT_NE(text.find("\n  GPU: cannot be used: no usable GPU"), std::string::npos) << text;
  EXPECT_EQ(text.find("GPU: ok"), std::string::npos) << text;
}

/// A listening socket of this process, and its port.
struct TakenPort {
  capture::Descriptor socket{::socket(AF_INET, SOCK_STREAM, 0)};
  int port = 0;

  TakenPort() {
    sockaddr_in address{};
    address.sin_family = AF_INET;
    address.sin_addr.s_addr = htonl(INADDR_LOOPBACK);
    socklen_t size = sizeof(address);
    auto* const generic = reinterpret_cast<sockaddr*>(&address);
    if (bind(socket.number(), generic, size) != 0 || listen(socket.number(), 1) != 0) return;
    if (getsockname(socket.number(), generic, &size) == 0) port = ntohs(address.sin_port);
  }
};

constexpr const char* kMissing = "something that serve and replay need is missing";

TEST(Doctor, ChecksAConfigurationAsServeWouldFindIt) {
  const TinySession tiny("doctor");
  const std::string config = "--config " + (tiny.folder / "kiosk.toml").string();
  tiny.write("kiosk.toml", "session = \".\"\n[server]\nlisten = \"127.0.0.1:0\"\n");
  {
    const auto [text, good] = doctor_with("", config);
    EXPECT_TRUE(good) << text;
    EXPECT_NE(text.find("kiosk.toml: ok, 1 objects, all models are loaded"), std::string::npos) << text;
    EXPECT_NE(text.find("listener http://127.0.0.1:0/: ok, free"), std::string::npos) << text;
  }
  const TakenPort taken;
  ASSERT_NE(taken.port, 0);
  tiny.write("kiosk.toml", "session = \".\"\n[server]\nlisten = \"127.0.0.1:" + std::to_string(taken.port) + "\"\n");
  {
    const auto [text, good] = doctor_with("", config);
    EXPECT_FALSE(good) << text;
    EXPECT_NE(text.find("Address already in use\n    mend: `sudo ss -ltnp 'sport = :" + std::to_string(taken.port)),
              std::string::npos)
        << text;
    EXPECT_NE(text.find(kMissing), std::string::npos);
  }
  tiny.write("kiosk.toml", "session = \".\"\n[server]\nlissen = 1\n");
  {
    const auto [text, good] = doctor_with("", config);
    EXPECT_FALSE(good) << text;
    EXPECT_NE(text.find("kiosk.toml:3: server.lissen"), std::string::npos) << text;
  }
  tiny.write("kiosk.toml", "session = \".\"\n");
  tiny.write("pyramid.obj", "v 0 0 0\n");
  const auto [text, good] = doctor_with("", config);
  EXPECT_FALSE(good) << text;
  EXPECT_NE(text.find("pyramid.obj"), std::string::npos) << text;
}

TEST(Doctor, SaysWhatThisUserMayNotUse) {
  if (geteuid() != 0) GTEST_SKIP() << "needs root, to be another user";
  const TinySession tiny("doctor-user");
  tiny.write("kiosk.toml", "session = \".\"\n[server]\nlisten = \"127.0.0.1:0\"\nroom = \"closed/kept.room\"\n");
  std::filesystem::create_directory(tiny.folder / "closed");
  std::filesystem::permissions(tiny.folder / "closed", std::filesystem::perms::owner_all);
  // A private /dev with the node of a GPU, which only root and the group video may use.
  const std::string private_dev =
      "mount -t tmpfs none /dev && mknod -m 666 /dev/null c 1 3 && mknod -m 666 /dev/urandom c 1 9 && mkdir /dev/dri "
      "&& "
      "touch /dev/dri/renderD128 && chgrp video /dev/dri/renderD128 && chmod 660 /dev/dri/renderD128";
  if (!said_by("unshare -m sh -c '" + private_dev + "'").second) GTEST_SKIP() << "needs to mount a /dev of its own";
  const std::string as_nobody = "setpriv --reuid=nobody --regid=nogroup --clear-groups --no-new-privs ";
  const auto [text, good] = said_by("unshare -m sh -c '" + private_dev + " && exec " + as_nobody + LUMIGRAFT_PROGRAM +
                                    " doctor --config " + (tiny.folder / "kiosk.toml").string() + "'");
  EXPECT_FALSE(good) << text;
  EXPECT_NE(text.find("GPU node /dev/dri/renderD128: note, this user may not use it\n    mend: sudo usermod -aG video "
                      "nobody, then log in again"),
            std::string::npos)
      << text;
  EXPECT_NE(text.find("user: nobody"), std::string::npos) << text;
  EXPECT_NE(text.find("folder of the room: cannot be used: " + (tiny.folder / "closed").string() +
                      ": Permission denied\n    mend: sudo install -d -o nobody "),
            std::string::npos)
      << text;
}

TEST(Doctor, SaysWhatTheMachineLacks) {
  std::ostringstream out;
  DoctorReport report(out);
  check_clock(report, std::chrono::system_clock::time_point{});
  check_memory(report, 768, std::uintmax_t{1'000'000'000});
  EXPECT_NE(out.str().find("clock: note, it is not set, 1970-01-01"), std::string::npos) << out.str();
  EXPECT_NE(out.str().find("mend: server.max_field_memory_mb = 500"), std::string::npos) << out.str();
  EXPECT_TRUE(report.good()) << "serve works all the same";
  check_memory(report, 768, std::uintmax_t{4'000'000'000});
  EXPECT_NE(out.str().find("memory: ok, "), std::string::npos) << out.str();
  EXPECT_GT(usable_memory_bytes().value_or(0), std::uintmax_t{100'000'000});
}

}  // namespace
}  // namespace lumigraft::server
