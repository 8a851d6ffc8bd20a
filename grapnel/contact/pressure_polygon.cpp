#include <algorithm>
#include <bit>
#include <cmath>
#include <cstdint>
#include <limits>

#include "grapnel/contact/contact_element.hpp"
#include "grapnel/contact/few_corners.hpp"

namespace grapnel {

// Polygons of pressure contacts: parts of planes that linear functions of the position bound. They are kept as
// projections along the coordinate axis nearest to the plane's normal, relative to origin_.

void PressureContact::FieldTable::set(std::size_t k, const Field& field) {
  for (int i = 0; i < 3; ++i) gradient[i][k] = field.gradient[i];
  constant[k] = field.constant;
}

void PressureContact::FieldTable::push_back(const Field& field) {
  for (int i = 0; i < 3; ++i) gradient[i].push_back(field.gradient[i]);
  constant.push_back(field.constant);
}

void PressureContact::FieldTable::resize(std::size_t size) {
  for (std::vector<double>& numbers : gradient) numbers.resize(size);
  constant.resize(size);
}

void PressureContact::FieldTable::reserve(std::size_t size) {
  for (std::vector<double>& numbers : gradient) numbers.reserve(size);
  constant.reserve(size);
}

Vector3d PressureContact::Plane::point(const Corner& x) const {
  Vector3d p;
  p[s] = x.s, p[t] = x.t, p[h] = height.at(x);
  return p;
}

// A field on the plane.
PressureContact::Line PressureContact::Plane::restricted(const Field& field) const {
  const Vector3d& g = field.gradient;
  return {field.constant - g[h] * height.constant, -(g[s] + g[h] * height.along_s), -(g[t] + g[h] * height.along_t)};
}

void PressureContact::reserve_corners(std::size_t corners) {
  polygon_.resize(corners), clipped_.resize(corners), inside_.resize(corners);
}

// The polygon of a face => a sphere around all points at most `margin` away from it.
PressureContact::Cell PressureContact::cell_of_polygon(double margin) const {
  Cell cell{Vector3d::zero(), 0};
  for (std::size_t i = 0; i < corners_; ++i) cell.center += plane_.point(polygon_[i]);
  cell.center *= 1.0 / static_cast<double>(corners_);
  double square = 0;
  for (std::size_t i = 0; i < corners_; ++i) {
    const Vector3d r = plane_.point(polygon_[i]) - cell.center;
    square = std::max(square, dot(r, r));
  }
  cell.radius = 1.001 * (std::sqrt(square) + margin);
  return cell;
}

// Farthest distance from the origin along a unit vector of points in the box enlarged by a margin.
double PressureContact::region_reach(const Vector3d& normal, double margin) const {
  double reach = 0;
  for (int k = 0; k < 3; ++k) reach += std::abs(dot(normal, region_.axes[k])) * (region_.half[k] + margin);
  return reach;
}

// Keeps the part of the polygon where a function is not negative; false if there is none. Of a convex polygon the
// corners outside are consecutive ones, except for rounding errors.
bool PressureContact::clip(const Line& line) {
  constexpr std::size_t kFew = 8;
  const std::size_t n = corners_;
  if (2 * n > clipped_.size()) reserve_corners(4 * n);
  double* const value = inside_.data();
  const Corner* const from = polygon_.data();
  std::uint64_t outside = 0;  // one bit per corner
  if (n <= kFew) {            // by SIMD registers, also beyond the last corner
    for (std::size_t i = 0; i < kFew; ++i) {
      value[i] = line.at(from[i]) + 0.0;  // no negative zero
      outside |= std::bit_cast<std::uint64_t>(value[i]) >> 63 << i;
    }
  } else {
    for (std::size_t i = 0; i < n; ++i) value[i] = line.at(from[i]);
    if (n > 64) return clip_scattered();
    for (std::size_t i = 0; i < n; ++i) outside |= std::uint64_t{value[i] < 0} << i;
  }
  const std::uint64_t all = ~std::uint64_t{0} >> (64 - n);
  outside &= all;
  if (outside == 0) return true;
  const std::uint64_t before = (outside << 1 | outside >> (n - 1)) & all;
  if (outside == all) return false;
  const std::uint64_t begins = outside & ~before;
  if (!std::has_single_bit(begins)) return clip_scattered();
  const std::size_t last = std::countr_zero(begins);              // the first one outside
  const std::size_t first = std::countr_zero(before & ~outside);  // the first one inside
  const std::size_t kept = n - std::popcount(outside);
  const auto between = [&](std::size_t i, std::size_t j) {
    const double part = value[i] / (value[i] - value[j]);
    return Corner{from[i].s + part * (from[j].s - from[i].s), from[i].t + part * (from[j].t - from[i].t)};
  };
  // From the corner `first` on, all inside, then both new ones.
  Corner* const to = clipped_.data();
  for (std::size_t k = 0, i = first; k < kept; ++k, i = i + 1 < n ? i + 1 : 0) to[k] = from[i];
  to[kept] = between(last > 0 ? last - 1 : n - 1, last);
  to[kept + 1] = between(first, first > 0 ? first - 1 : n - 1);
  corners_ = kept + 2;
  polygon_.swap(clipped_);
  return true;
}

// The same by the values in inside_, for any order of corners.
bool PressureContact::clip_scattered() {
  const std::size_t n = corners_;
  const double* const value = inside_.data();
  const Corner* const from = polygon_.data();
  Corner* to = clipped_.data();
  for (std::size_t i = 0; i < n; ++i) {
    const std::size_t j = i + 1 < n ? i + 1 : 0;
    if (value[i] >= 0) *to++ = from[i];
    if ((value[i] >= 0) != (value[j] >= 0)) {
      const double part = value[i] / (value[i] - value[j]);
      *to++ = {from[i].s + part * (from[j].s - from[i].s), from[i].t + part * (from[j].t - from[i].t)};
    }
  }
  corners_ = static_cast<std::size_t>(to - clipped_.data());
  polygon_.swap(clipped_);
  return corners_ >= 3;
}

namespace {

// The plane on which `across` is zero. Templates, since planes and fields are private types.
template <class Plane, class Field>
GRAPNEL_INLINE void set_plane(Plane& plane, const Field& across) {
  const Vector3d& w = across.gradient;
  int h = std::abs(w[1]) > std::abs(w[0]) ? 1 : 0;
  if (std::abs(w[2]) > std::abs(w[h])) h = 2;
  const int s = h == 2 ? 0 : h + 1, t = h == 0 ? 2 : h - 1;
  const double inverse = 1 / w[h];
  plane = {s, t, h, w, {across.constant * inverse, -w[s] * inverse, -w[t] * inverse}};
}

template <class Field>
GRAPNEL_INLINE bool misses_ball(const Field& across, double radius) {
  return across.constant * across.constant > radius * radius * dot(across.gradient, across.gradient);
}

}  // namespace

// The plane on which `across` is zero => plane_, and polygon_, which contains its section with the region: the section
// with the region's box enlarged by a margin, or its part above a square. False if the plane misses the region.
bool PressureContact::begin_polygon(const Field& across, double margin) {
  const double radius = region_.radius + 1.7321 * margin;
  if (boxed_ ? std::abs(across.constant) > region_reach(across.gradient, margin) : misses_ball(across, radius))
    return false;
  set_plane(plane_, across);
  corners_ = 4;
  polygon_[0] = {radius, radius}, polygon_[1] = {-radius, radius};
  polygon_[2] = {-radius, -radius}, polygon_[3] = {radius, -radius};
  if (!boxed_) return true;
  for (int k = 0; k < 3; ++k) {
    const Vector3d& axis = region_.axes[k];
    const double half = region_.half[k] + margin;
    if (!clip(plane_.restricted({axis, half})) || !clip(plane_.restricted({-axis, half}))) return false;
  }
  return true;
}

#if defined(GRAPNEL_CUT_IN_REGISTERS)

namespace {

using few_corners::Rest;

// The part of a plane around the circle with a radius about its origin in which the pressure is from 0 to a bound: the
// points low to high times (along_s, along_t), and as far as `wide` times a perpendicular of the same length to both
// sides. Where the pressure is nearly constant the whole square.
struct Strip {
  double along_s, along_t, low, high, wide;
  bool is_whole;
};

Strip whole_square(double radius) { return {1, 0, -radius, radius, radius, true}; }

template <class Line>
GRAPNEL_INLINE Strip strip_of(const Line& pressure, double bound, double radius) {
  constexpr double kFlat = 1e-6;  // change of the pressure, relative to the bound
  const double a = pressure.along_s, b = pressure.along_t, length = std::abs(a) + std::abs(b);  // 1 to 1.41421 times
  if (!(length * radius > kFlat * bound)) return whole_square(radius);
  const double wide = 1.4143 * radius / length, inverse = 1 / (a * a + b * b);
  return {
      a,    b,    std::max(-wide, -pressure.constant * inverse), std::min(wide, (bound - pressure.constant) * inverse),
      wide, false};
}

template <class Line>
GRAPNEL_INLINE Rest clip_by_line(few_corners::Polygon& polygon, const Line& line) {
  return few_corners::clip(polygon, line.constant, line.along_s, line.along_t);
}

GRAPNEL_INLINE few_corners::Polygon polygon_of(const Strip& strip) {
  const __m512d along = _mm512_mask_blend_pd(0b0110, _mm512_set1_pd(strip.low), _mm512_set1_pd(strip.high));
  const __m512d beside = _mm512_mask_blend_pd(0b1100, _mm512_set1_pd(-strip.wide), _mm512_set1_pd(strip.wide));
  return {strip.along_s * along - strip.along_t * beside, strip.along_t * along + strip.along_s * beside, 4};
}

// Keeps the part of the polygon within the region's box enlarged by a margin.
template <class Plane, class Region>
GRAPNEL_INLINE Rest clip_by_box(few_corners::Polygon& polygon, const Plane& plane, const Region& region,
                                double margin) {
  Rest rest = Rest::some;
  for (int k = 0; k < 3 && rest == Rest::some; ++k) {
    const double half = region.half[k] + margin;
    rest = clip_by_line(polygon, plane.restricted({region.axes[k], half}));
    if (rest == Rest::some) rest = clip_by_line(polygon, plane.restricted({-region.axes[k], half}));
  }
  return rest;
}

// Fields that may cut a polygon: all from `first` on but those that are done. `last`: that of the last clip.
struct OtherFields {
  std::size_t first, done[4], last;
};

// As PressureContact::clip_by_others().
template <class Plane, class Fields, class Field>
GRAPNEL_INLINE Rest clip_by_fields(few_corners::Polygon& polygon, const Plane& plane, const Fields& fields,
                                   const Field& base, OtherFields& others) {
  const double low_s = _mm512_reduce_min_pd(polygon.s), high_s = _mm512_reduce_max_pd(polygon.s);
  const double low_t = _mm512_reduce_min_pd(polygon.t), high_t = _mm512_reduce_max_pd(polygon.t);
  const double middle_s = 0.5 * (low_s + high_s), half_s = 0.5 * (high_s - low_s);
  const double middle_t = 0.5 * (low_t + high_t), half_t = 0.5 * (high_t - low_t);
  const double *g_s = fields.gradient[plane.s].data(), *g_t = fields.gradient[plane.t].data();
  const double *g_h = fields.gradient[plane.h].data(), *constant = fields.constant.data();
  const double base_s = base.gradient[plane.s], base_t = base.gradient[plane.t], base_h = base.gradient[plane.h];
  const auto height = plane.height;
  for (std::size_t begin = others.first; begin < fields.size(); begin += 8) {
    const std::size_t count = std::min<std::size_t>(8, fields.size() - begin);
    const auto valid = static_cast<__mmask8>((1u << count) - 1);
    const auto of = [&](const double* numbers)
                        GRAPNEL_INLINE_LAMBDA { return _mm512_maskz_loadu_pd(valid, numbers + begin); };
    const __m512d rise = of(g_h) - base_h;
    const __m512d c = of(constant) - base.constant - rise * height.constant;
    const __m512d s = base_s - of(g_s) - rise * height.along_s, t = base_t - of(g_t) - rise * height.along_t;
    const __m512d least = c + s * middle_s + t * middle_t - _mm512_abs_pd(s) * half_s - _mm512_abs_pd(t) * half_t;
    unsigned cutting = _mm512_mask_cmp_pd_mask(valid, least, _mm512_setzero_pd(), _CMP_LT_OQ);
    for (const std::size_t k : others.done) {
      if (k - begin < 8) cutting &= ~(1u << (k - begin));
    }
    alignas(64) double line[3][8];
    _mm512_store_pd(line[0], c), _mm512_store_pd(line[1], s), _mm512_store_pd(line[2], t);
    for (; cutting != 0; cutting &= cutting - 1) {
      const auto k = static_cast<std::size_t>(std::countr_zero(cutting));
      others.last = begin + k;
      const Rest rest = few_corners::clip(polygon, line[0][k], line[1][k], line[2][k]);
      if (rest != Rest::some) return rest;
    }
  }
  return Rest::some;
}

}  // namespace

#endif

// The part, within the overlap, of the plane on which `across` is zero, where the pressure `base`, zero or one field's,
// is the least => polygon_. On the plane the fields i and j equal base.
bool PressureContact::cut(const Field& across, const Field& base, std::size_t i, std::size_t j) {
#if defined(GRAPNEL_CUT_IN_REGISTERS)
  const double radius = region_.radius;
  const auto in_registers = [&] {
    if (boxed_ ? std::abs(across.constant) > region_reach(across.gradient, 0) : misses_ball(across, radius))
      return Rest::none;
    set_plane(plane_, across);
    const Plane plane = plane_;
    const Line pressure = plane.restricted(base);
    const Strip strip = strip_of(pressure, bound_, radius);
    if (!(strip.low < strip.high)) return Rest::none;
    few_corners::Polygon polygon = polygon_of(strip);
    Rest rest = Rest::some;
    const auto clipped = [&](const Line& line) GRAPNEL_INLINE_LAMBDA {
      rest = clip_by_line(polygon, line);
      return rest == Rest::some;
    };
    if (strip.is_whole &&
        (!clipped(pressure) || !clipped({bound_ - pressure.constant, -pressure.along_s, -pressure.along_t})))
      return rest;
    if (boxed_) rest = clip_by_box(polygon, plane, region_, 0);
    if (rest != Rest::some) return rest;
    // First those fields that probably leave nothing.
    for (const std::size_t k : {lowest_a_, lowest_b_}) {
      if (k != i && k != j && !clipped(plane.restricted(fields_[k] - base))) return rest;
    }
    OtherFields others{0, {i, j, lowest_a_, lowest_b_}, 0};
    rest = clip_by_fields(polygon, plane, fields_, base, others);
    few_corners::store(polygon, &polygon_[0].s);
    corners_ = polygon.corners;
    return rest;
  };
  const Rest rest = in_registers();
  if (rest != Rest::unknown) return rest == Rest::some;
#endif
  if (!begin_polygon(across, 0)) return false;
  const Line pressure = plane_.restricted(base);
  if (!clip(pressure) || !clip({bound_ - pressure.constant, -pressure.along_s, -pressure.along_t})) return false;
  for (const std::size_t k : {lowest_a_, lowest_b_}) {
    if (k != i && k != j && !clip(plane_.restricted(fields_[k] - base))) return false;
  }
  return clip_by_others(base, i, j);
}

// Keeps the part of the polygon where no field except i and j is less than base. Fields that exceed it on the whole
// rectangle around the polygon need no clip; this is found for several of them at a time.
bool PressureContact::clip_by_others(const Field& base, std::size_t i, std::size_t j) {
  Corner low = polygon_[0], high = polygon_[0];
  for (std::size_t k = 1; k < corners_; ++k) {
    low = {std::min(low.s, polygon_[k].s), std::min(low.t, polygon_[k].t)};
    high = {std::max(high.s, polygon_[k].s), std::max(high.t, polygon_[k].t)};
  }
  const Corner middle{0.5 * (low.s + high.s), 0.5 * (low.t + high.t)};
  const double half_s = 0.5 * (high.s - low.s), half_t = 0.5 * (high.t - low.t);
  const std::size_t n = fields_.size();
  for (std::vector<double>& numbers : lines_) numbers.resize(n);
  least_.resize(n);
  const double *g_s = fields_.gradient[plane_.s].data(), *g_t = fields_.gradient[plane_.t].data();
  const double *g_h = fields_.gradient[plane_.h].data(), *constant = fields_.constant.data();
  double *line = lines_[0].data(), *along_s = lines_[1].data(), *along_t = lines_[2].data(), *least = least_.data();
  const double base_s = base.gradient[plane_.s], base_t = base.gradient[plane_.t], base_h = base.gradient[plane_.h];
  const Line height = plane_.height;
  for (std::size_t k = 0; k < n; ++k) {
    const double rise = g_h[k] - base_h;
    const double c = constant[k] - base.constant - rise * height.constant;
    const double s = base_s - g_s[k] - rise * height.along_s, t = base_t - g_t[k] - rise * height.along_t;
    line[k] = c, along_s[k] = s, along_t[k] = t;
    least[k] = c + s * middle.s + t * middle.t - std::abs(s) * half_s - std::abs(t) * half_t;
  }
  for (std::size_t k = 0; k < n; ++k) {
    if (least[k] >= 0 || k == i || k == j || k == lowest_a_ || k == lowest_b_) continue;
    if (!clip({line[k], along_s[k], along_t[k]})) return false;
  }
  return true;
}

// The fields of one shape, from `first` on => those that are the least somewhere near the overlap. The nearest face of
// a point is that on which it projects, at most bound_ / slope away; a face without such points has no polygon here.
void PressureContact::prune(std::size_t first) {
  constexpr std::size_t kFew = 8, kMany = 400;
  if (fields_.size() <= first + kFew) {
    cells_.resize(fields_.size(), {Vector3d::zero(), std::numeric_limits<double>::infinity()});
    return;
  }
  keep_lowest(first, kMany);
  is_least_.assign(fields_.size(), 1);
  cells_.resize(fields_.size());
  std::size_t rejecting = first;  // the field that rejected the previous one often rejects the next one
  for (std::size_t i = first; i < fields_.size(); ++i) {
    const Field field = fields_[i];
    const double margin = bound_ / norm(field.gradient);
    const std::size_t tried = rejecting;
#if defined(GRAPNEL_CUT_IN_REGISTERS)
    const auto in_registers = [&] {
      const double radius = region_.radius + 1.7321 * margin;
      if (boxed_ ? std::abs(field.constant) > region_reach(field.gradient, margin) : misses_ball(field, radius))
        return Rest::none;
      set_plane(plane_, field);
      few_corners::Polygon polygon = polygon_of(whole_square(radius));
      Rest rest = boxed_ ? clip_by_box(polygon, plane_, region_, margin) : Rest::some;
      if (rest == Rest::some && tried != i) rest = clip_by_line(polygon, plane_.restricted(fields_[tried]));
      if (rest != Rest::some) return rest;
      OtherFields others{first, {i, tried, i, tried}, tried};
      rest = clip_by_fields(polygon, plane_, fields_, Field{Vector3d::zero(), 0}, others);
      if (rest == Rest::none) rejecting = others.last;
      few_corners::store(polygon, &polygon_[0].s);
      corners_ = polygon.corners;
      return rest;
    };
    const Rest rest = in_registers();
    is_least_[i] = rest == Rest::some;
    if (is_least_[i]) cells_[i] = cell_of_polygon(margin);
    if (rest != Rest::unknown) continue;
#endif
    const auto clip_by = [&](std::size_t k) { return clip(plane_.restricted(fields_[k])); };
    is_least_[i] = begin_polygon(field, margin) && (tried == i || clip_by(tried));
    for (std::size_t k = first; is_least_[i] && k < fields_.size(); ++k) {
      if (k != i && k != tried && !clip_by(k)) is_least_[i] = 0, rejecting = k;
    }
    if (is_least_[i]) cells_[i] = cell_of_polygon(margin);
  }
  std::size_t kept = first;
  for (std::size_t i = first; i < fields_.size(); ++i) {
    if (is_least_[i]) cells_[kept] = cells_[i], fields_.set(kept++, fields_[i]);
  }
  fields_.resize(kept), cells_.resize(kept);
}

// Of the polygon [m^2].
double PressureContact::area_and_centroid(Corner& centroid) const {
  const Corner& first = polygon_[0];
  double twice = 0, moment_s = 0, moment_t = 0;
  for (std::size_t i = 1; i + 1 < corners_; ++i) {
    const double p_s = polygon_[i].s - first.s, p_t = polygon_[i].t - first.t;
    const double q_s = polygon_[i + 1].s - first.s, q_t = polygon_[i + 1].t - first.t;
    const double part = p_s * q_t - p_t * q_s;
    twice += part;
    moment_s += part * (p_s + q_s), moment_t += part * (p_t + q_t);
  }
  centroid = first;
  if (twice > 0) centroid.s += moment_s / (3 * twice), centroid.t += moment_t / (3 * twice);
  return 0.5 * twice * plane_.stretch();
}

}  // namespace grapnel
