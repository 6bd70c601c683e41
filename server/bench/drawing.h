#pragma once
// A vector drawing, written as SVG and PNG.
#include <filesystem>
#include <memory>
#include <string>
#include <vector>

namespace lumigraft::server {

struct Point {
  double x = 0, y = 0;  ///< y down
};

struct Box {
  double left = 0, top = 0, right = 0, bottom = 0;
  bool overlaps(const Box& o) const { return left < o.right && o.left < right && top < o.bottom && o.top < bottom; }
};

struct Colour {
  double r = 0, g = 0, b = 0, alpha = 1;
  Colour faded(double opacity) const { return {r, g, b, alpha * opacity}; }
};

struct Stroke {
  Colour colour;
  double width = 1;
  double dash = 0;  ///< 0: solid
};

struct TextStyle {
  double size = 12;
  Colour colour{0.13, 0.13, 0.13, 1};
  bool bold = false;
  double across = 0;  ///< 0: the point is the text's left end, 0.5 its middle, 1 its right end
  double turn_degrees = 0;
};

enum class Mark { disk, square, diamond, triangle };

class Drawing {
 public:
  Drawing(double width, double height);  ///< white background
  ~Drawing();

  void line(const std::vector<Point>& points, const Stroke& stroke);
  void fill(const Box& box, const Colour& colour);
  /// Hollow marks are white inside.
  void mark(Mark mark, const Point& centre, double radius, const Colour& colour, bool hollow = false);
  void text(const Point& baseline, const std::string& text, const TextStyle& style);
  double text_width(const std::string& text, const TextStyle& style) const;

  // Throw std::runtime_error where the file cannot be written.
  void write_svg(const std::filesystem::path& path) const;
  void write_png(const std::filesystem::path& path, double pixels_per_unit) const;

 private:
  struct State;
  std::unique_ptr<State> state_;
};

}  // namespace lumigraft::server
