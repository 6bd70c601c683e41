#pragma once
// Keys of a small colour camera for sessions that tests write, without its source.

namespace lumigraft::test {

constexpr char kSmallCamera[] = "width = 160\nheight = 120\nfx = 130\nfy = 130\ncx = 79.5\ncy = 59.5\nexposure = 2.0\n";

}  // namespace lumigraft::test
