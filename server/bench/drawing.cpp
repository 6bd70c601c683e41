#include "server/bench/drawing.h"

#include <cairo-svg.h>
#include <cairo.h>

#include <cmath>
#include <numbers>
#include <stdexcept>

namespace lumigraft::server {
namespace {

constexpr double kTau = 2 * std::numbers::pi;

struct FreeCairo {
  void operator()(cairo_surface_t* surface) const { cairo_surface_destroy(surface); }
  void operator()(cairo_t* context) const { cairo_destroy(context); }
};
using Surface = std::unique_ptr<cairo_surface_t, FreeCairo>;
using Context = std::unique_ptr<cairo_t, FreeCairo>;

void use(cairo_t* c, const Colour& colour) { cairo_set_source_rgba(c, colour.r, colour.g, colour.b, colour.alpha); }

void use(cairo_t* c, const TextStyle& style) {
  use(c, style.colour);
  cairo_select_font_face(c, "sans-serif", CAIRO_FONT_SLANT_NORMAL,
                         style.bold ? CAIRO_FONT_WEIGHT_BOLD : CAIRO_FONT_WEIGHT_NORMAL);
  cairo_set_font_size(c, style.size);
}

void check(cairo_status_t status, const std::filesystem::path& path) {
  if (status != CAIRO_STATUS_SUCCESS) throw std::runtime_error(path.string() + ": " + cairo_status_to_string(status));
}

void polygon(cairo_t* c, const Point& centre, double radius, int corners, double first_rad) {
  for (int i = 0; i < corners; ++i) {
    const double angle = first_rad + kTau * i / corners;
    cairo_line_to(c, centre.x + radius * std::cos(angle), centre.y + radius * std::sin(angle));
  }
  cairo_close_path(c);
}

}  // namespace

struct Drawing::State {
  double width, height;
  Surface recording;
  Context context;

  State(double w, double h) : width(w), height(h) {
    const cairo_rectangle_t extents{0, 0, w, h};
    recording.reset(cairo_recording_surface_create(CAIRO_CONTENT_COLOR_ALPHA, &extents));
    context.reset(cairo_create(recording.get()));
    // No hinting: text keeps its width at every scale.
    cairo_font_options_t* options = cairo_font_options_create();
    cairo_font_options_set_hint_style(options, CAIRO_HINT_STYLE_NONE);
    cairo_font_options_set_hint_metrics(options, CAIRO_HINT_METRICS_OFF);
    cairo_font_options_set_antialias(options, CAIRO_ANTIALIAS_GRAY);
    cairo_set_font_options(context.get(), options);
    cairo_font_options_destroy(options);
  }

  void replay(cairo_surface_t* onto, double scale) const {
    const Context c(cairo_create(onto));
    cairo_scale(c.get(), scale, scale);
    cairo_set_source_surface(c.get(), recording.get(), 0, 0);
    cairo_paint(c.get());
  }
};

Drawing::Drawing(double width, double height) : state_(std::make_unique<State>(width, height)) {
  fill({0, 0, width, height}, {1, 1, 1, 1});
}

Drawing::~Drawing() = default;

void Drawing::line(const std::vector<Point>& points, const Stroke& stroke) {
  cairo_t* c = state_->context.get();
  cairo_new_path(c);
  for (const Point& p : points) cairo_line_to(c, p.x, p.y);
  use(c, stroke.colour);
  cairo_set_line_width(c, stroke.width);
  cairo_set_line_join(c, CAIRO_LINE_JOIN_ROUND);
  cairo_set_dash(c, &stroke.dash, stroke.dash > 0 ? 1 : 0, 0);
  cairo_stroke(c);
}

void Drawing::fill(const Box& box, const Colour& colour) {
  cairo_t* c = state_->context.get();
  use(c, colour);
  cairo_new_path(c);
  cairo_rectangle(c, box.left, box.top, box.right - box.left, box.bottom - box.top);
  cairo_fill(c);
}

void Drawing::mark(Mark mark, const Point& centre, double radius, const Colour& colour, bool hollow) {
  cairo_t* c = state_->context.get();
  cairo_new_path(c);
  // Radii for marks of equal apparent size.
  switch (mark) {
    case Mark::disk:
      cairo_arc(c, centre.x, centre.y, radius, 0, kTau);
      break;
    case Mark::square:
      polygon(c, centre, 1.25 * radius, 4, kTau / 8);
      break;
    case Mark::diamond:
      polygon(c, centre, 1.3 * radius, 4, 0);
      break;
    case Mark::triangle:
      polygon(c, centre, 1.35 * radius, 3, -kTau / 4);
      break;
  }
  use(c, hollow ? Colour{1, 1, 1, 1} : colour);
  cairo_fill_preserve(c);
  use(c, hollow ? colour : Colour{1, 1, 1, 1});
  cairo_set_dash(c, nullptr, 0, 0);
  cairo_set_line_width(c, hollow ? 1.5 : 1.0);
  cairo_stroke(c);
}

void Drawing::text(const Point& baseline, const std::string& text, const TextStyle& style) {
  cairo_t* c = state_->context.get();
  use(c, style);
  cairo_save(c);
  cairo_translate(c, baseline.x, baseline.y);
  cairo_rotate(c, style.turn_degrees * kTau / 360);
  cairo_move_to(c, -style.across * text_width(text, style), 0);
  cairo_show_text(c, text.c_str());
  cairo_restore(c);
}

double Drawing::text_width(const std::string& text, const TextStyle& style) const {
  cairo_t* c = state_->context.get();
  use(c, style);
  cairo_text_extents_t extents;
  cairo_text_extents(c, text.c_str(), &extents);
  return extents.x_advance;
}

void Drawing::write_svg(const std::filesystem::path& path) const {
  const Surface surface(cairo_svg_surface_create(path.c_str(), state_->width, state_->height));
  check(cairo_surface_status(surface.get()), path);
  state_->replay(surface.get(), 1);
  cairo_surface_finish(surface.get());
  check(cairo_surface_status(surface.get()), path);
}

void Drawing::write_png(const std::filesystem::path& path, double pixels_per_unit) const {
  const Surface surface(cairo_image_surface_create(CAIRO_FORMAT_RGB24,
                                                   static_cast<int>(std::lround(state_->width * pixels_per_unit)),
                                                   static_cast<int>(std::lround(state_->height * pixels_per_unit))));
  state_->replay(surface.get(), pixels_per_unit);
  check(cairo_surface_write_to_png(surface.get(), path.c_str()), path);
}

}  // namespace lumigraft::server
