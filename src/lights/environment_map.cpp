// SPDX-License-Identifier: Apache-2.0
#include "lights/environment_map.h"

#include "base/check.h"

#include <algorithm>
#include <cmath>
#include <numbers>
#include <utility>

namespace velatura::lights {
namespace {

double texel_luminance(const Rgb& c) {
    return double(luminance(c));
}

Rgb blend(const Rgb& a, const Rgb& b, const Rgb& c, const Rgb& d, double fx, double fy) {
    // Weights are never negative: a blend of texels stays within them
    const float wa = float((1.0 - fx) * (1.0 - fy)), wb = float(fx * (1.0 - fy));
    const float wc = float((1.0 - fx) * fy), wd = float(fx * fy);
    return a * wa + b * wb + c * wc + d * wd;
}

/// Number in [0,1] with a density linear from a at 0 to b at 1.
double sample_linear(double u, double a, double b) {
    if (!(a + b > 0.0)) return u;
    // Stable inverse of the quadratic; no division by b − a
    const double root = std::sqrt((1.0 - u) * a * a + u * b * b);
    return std::clamp(u * (a + b) / (a + root), 0.0, 1.0);
}

Vec3d direction_of(double theta, double u) {
    const double longitude = 2.0 * pi_d * (0.5 - u);
    const double s = std::sin(theta);
    return {s * std::sin(longitude), std::cos(theta), s * std::cos(longitude)};
}

Vec2d uv_of(const Vec3d& d, double* sin_theta) {
    const double s = std::sqrt(d.x * d.x + d.z * d.z);
    *sin_theta = s;
    const double longitude = s > 0.0 ? std::atan2(d.x, d.z) : 0.0;
    return {0.5 - longitude / (2.0 * pi_d), std::atan2(s, d.y) / pi_d};
}

/// Where a unit direction lies in an image of another layout, uv from the upper left corner. Beyond
/// max_radius (1 = the border of the image) a disk is read there.
Vec2d uv_in_layout(const Vec3d& d, scene::DomeFormat format, double max_radius) {
    if (format == scene::DomeFormat::CubeMapVerticalCross) {
        // Cells of thirds by quarters: +Y above, −X +Z +X in the second row, −Y, and −Z upside down
        // at the bottom
        const double ax = std::abs(d.x), ay = std::abs(d.y), az = std::abs(d.z);
        double column = 1.0, row = 1.0, a = 0.0, b = 0.0, major = az;
        if (ay >= ax && ay >= az) {
            major = ay;
            row = d.y > 0.0 ? 0.0 : 2.0;
            a = d.x;
            b = d.y > 0.0 ? d.z : -d.z;
        } else if (ax >= az) {
            major = ax;
            column = d.x > 0.0 ? 2.0 : 0.0;
            a = d.x > 0.0 ? -d.z : d.z;
            b = -d.y;
        } else if (d.z > 0.0) {
            a = d.x;
            b = -d.y;
        } else {
            row = 3.0;
            a = d.x;
            b = d.y;
        }
        return {(column + 0.5 * (a / major + 1.0)) / 3.0, (row + 0.5 * (b / major + 1.0)) / 4.0};
    }
    // Radius by the angle off the center of the image, which looks along −Z
    const double s = std::sqrt(d.x * d.x + d.y * d.y);
    const double angle = std::atan2(s, -d.z);
    const double r = format == scene::DomeFormat::Angular ? angle / pi_d : std::sin(0.5 * angle);
    const double k = s > 0.0 ? 0.5 * std::min(r, max_radius) / s : 0.0;
    return {0.5 + d.x * k, 0.5 - d.y * k};
}

}  // namespace

Rgb bilinear_clamped(const EnvironmentImage& image, const Vec2d& uv) {
    const double x = std::clamp(uv.x * image.width - 0.5, 0.0, double(image.width - 1));
    const double y = std::clamp(uv.y * image.height - 0.5, 0.0, double(image.height - 1));
    const size_t x0 = size_t(x), y0 = size_t(y);
    const size_t x1 = std::min(x0 + 1, size_t(image.width) - 1);
    const size_t y1 = std::min(y0 + 1, size_t(image.height) - 1);
    const auto texel = [&](size_t i, size_t j) {
        return image.texels[j * size_t(image.width) + i];
    };
    return blend(texel(x0, y0), texel(x1, y0), texel(x0, y1), texel(x1, y1), x - double(x0),
                 y - double(y0));
}

float mean_luminance(const EnvironmentImage& image) {
    double sum = 0.0;
    for (const Rgb& texel : image.texels) sum += texel_luminance(texel);
    return image.texels.empty() ? 0.0f : float(sum / double(image.texels.size()));
}

size_t remove_bad_texels(EnvironmentImage& image) {
    size_t count = 0;
    for (Rgb& texel : image.texels) {
        // Written so that NaN counts as bad
        const bool is_good =
            is_finite(texel) && texel.x >= 0.0f && texel.y >= 0.0f && texel.z >= 0.0f;
        if (is_good) continue;
        texel = Rgb(0.0f);
        ++count;
    }
    return count;
}

EnvironmentImage to_latlong(EnvironmentImage image, scene::DomeFormat format) {
    if (format == scene::DomeFormat::LatLong || format == scene::DomeFormat::Automatic)
        return image;
    EnvironmentImage result;
    result.height = image.height;
    result.width = 2 * image.height;
    result.texels.resize(size_t(result.width) * size_t(result.height));
    // The corners of the image, which no direction has, are not blended into those at the rim
    const double max_radius =
        std::max(0.0, 1.0 - 2.0 * std::numbers::sqrt2 / std::min(image.width, image.height));
    for (int y = 0; y < result.height; ++y) {
        for (int x = 0; x < result.width; ++x) {
            const Vec3d d =
                direction_of(pi_d * (y + 0.5) / result.height, (x + 0.5) / result.width);
            result.texels[size_t(y) * size_t(result.width) + size_t(x)] =
                bilinear_clamped(image, uv_in_layout(d, format, max_radius));
        }
    }
    return result;
}

EnvironmentMap::EnvironmentMap(EnvironmentImage image, bool compensate_mis)
    : image_(std::move(image)) {
    VELATURA_CHECK(image_.width > 0 && image_.height > 0, "environment without texels");
    VELATURA_CHECK(image_.texels.size() == size_t(image_.width) * size_t(image_.height),
                   "environment of another size than its texels");
    for (int y = 0; y < image_.height; ++y)
        row_sine_.push_back(std::sin(pi_d * (y + 0.5) / image_.height));
    mean_luminance_ = measure_mean();
    total_ = build(compensate_mis ? mean_luminance_ : 0.0);
    if (!compensate_mis) return;

    // A constant map has nothing above its mean; it can still be sampled, but need not
    sampled_share_ = total_ > 0.0 ? total_ / (mean_luminance_ * mean_sine()) : 0.0;
    if (!(total_ > 0.0)) total_ = build(0.0);
}

double EnvironmentMap::mean_sine() const {
    double sum = 0.0;
    for (const double sine : row_sine_) sum += sine;
    return sum / image_.height;
}

double EnvironmentMap::measure_mean() const {
    double sum = 0.0, norm = 0.0;
    for (size_t y = 0; y < size_t(image_.height); ++y) {
        double row = 0.0;
        for (size_t x = 0; x < size_t(image_.width); ++x)
            row += texel_luminance(image_.texels[y * size_t(image_.width) + x]);
        sum += row * row_sine_[y];
        norm += row_sine_[y] * image_.width;
    }
    return sum / norm;
}

double EnvironmentMap::build(double floor) {
    floor_ = floor;
    const size_t width = size_t(image_.width), height = size_t(image_.height);
    std::vector<float> weights(width * (height + 1));
    std::vector<double> above(width), below(width);
    const auto read_row = [&](std::vector<double>& row, size_t y) {
        for (size_t i = 0; i < width; ++i) row[i] = weight(i, y);
    };
    read_row(below, 0);
    double sum = 0.0;
    for (size_t j = 0; j <= height; ++j) {
        // Cells at the poles are half as high, and have one row of texels alone
        const double cell_height = j == 0 || j == height ? 0.5 : 1.0;
        above = below;
        if (j > 0 && j < height) read_row(below, j);
        for (size_t i = 0; i < width; ++i) {
            const size_t right = i + 1 < width ? i + 1 : 0;
            const double w =
                0.25 * cell_height * (above[i] + above[right] + below[i] + below[right]);
            weights[j * width + i] = float(w);
            sum += double(weights[j * width + i]);
        }
    }
    cells_ = sampling::Distribution2D(weights, width, height + 1);
    return sum / (double(width) * double(height));
}

EnvironmentMap::Patch EnvironmentMap::patch_at(const Vec2d& uv) const {
    const double w = image_.width, h = image_.height;
    double x = uv.x * w - 0.5;
    if (x < 0.0) x += w;
    Patch p{};
    p.x0 = std::min(size_t(std::max(x, 0.0)), size_t(image_.width) - 1);
    p.x1 = p.x0 + 1 < size_t(image_.width) ? p.x0 + 1 : 0;
    p.fx = std::clamp(x - double(p.x0), 0.0, 1.0);
    const double y = std::clamp(uv.y * h - 0.5, 0.0, h - 1.0);
    p.y0 = size_t(y);
    p.y1 = std::min(p.y0 + 1, size_t(image_.height) - 1);
    p.fy = y - double(p.y0);
    return p;
}

Rgb EnvironmentMap::lookup(const Patch& p) const {
    const Rgb* row0 = &image_.texels[p.y0 * size_t(image_.width)];
    const Rgb* row1 = &image_.texels[p.y1 * size_t(image_.width)];
    return blend(row0[p.x0], row0[p.x1], row1[p.x0], row1[p.x1], p.fx, p.fy);
}

double EnvironmentMap::weight(size_t x, size_t y) const {
    const double l = texel_luminance(image_.texels[y * size_t(image_.width) + x]);
    return std::max(l - floor_, 0.0) * row_sine_[y];
}

double EnvironmentMap::interpolated_weight(const Patch& p) const {
    const double top = weight(p.x0, p.y0) * (1.0 - p.fx) + weight(p.x1, p.y0) * p.fx;
    const double bottom = weight(p.x0, p.y1) * (1.0 - p.fx) + weight(p.x1, p.y1) * p.fx;
    return top * (1.0 - p.fy) + bottom * p.fy;
}

double EnvironmentMap::density(const Patch& p, size_t column, size_t row, double sin_theta) const {
    const double mean =
        0.25 * (weight(p.x0, p.y0) + weight(p.x1, p.y0) + weight(p.x0, p.y1) + weight(p.x1, p.y1));
    if (!(mean > 0.0)) return 0.0;
    const double height = row == 0 || row == size_t(image_.height) ? 0.5 : 1.0;
    const double area = height / (double(image_.width) * double(image_.height));
    const double per_uv = cells_.pmf(column, row) / area * (interpolated_weight(p) / mean);
    return per_uv / (2.0 * pi_d * pi_d * sin_theta);
}

EnvironmentMap::View EnvironmentMap::view(const Vec3d& direction) const {
    double sin_theta = 0.0;
    const Vec2d uv = uv_of(direction, &sin_theta);
    const Patch patch = patch_at(uv);
    return {lookup(patch), pdf_at(uv, patch, sin_theta)};
}

double EnvironmentMap::pdf_at(const Vec2d& uv, Patch p, double sin_theta) const {
    if (!(sin_theta > 0.0)) return 0.0;
    const double rows_passed = std::floor(uv.y * double(image_.height) + 0.5);
    const size_t row = size_t(std::clamp(rows_passed, 0.0, double(image_.height)));
    if (row == 0) p.y1 = p.y0;  // between the pole and the first row there is that row alone
    return density(p, p.x0, row, sin_theta);
}

std::optional<EnvironmentMap::Sample> EnvironmentMap::sample(const Vec2& u) const {
    const sampling::Distribution2D::Sample cell = cells_.sample(u);
    if (!(cell.pdf > 0.0)) return std::nullopt;
    const size_t width = size_t(image_.width), height = size_t(image_.height);
    Patch p{};
    p.x0 = cell.column;
    p.x1 = p.x0 + 1 < width ? p.x0 + 1 : 0;
    p.y0 = cell.row > 0 ? cell.row - 1 : 0;
    p.y1 = std::min(cell.row, height - 1);

    // Inside the cell: first y by the sum over x, then x along that row
    const double ux = std::clamp(cell.xy.x * double(width) - double(cell.column), 0.0, 1.0);
    const double uy = std::clamp(cell.xy.y * double(height + 1) - double(cell.row), 0.0, 1.0);
    const double top = weight(p.x0, p.y0) + weight(p.x1, p.y0);
    const double bottom = weight(p.x0, p.y1) + weight(p.x1, p.y1);
    p.fy = sample_linear(uy, top, bottom);
    const double left = weight(p.x0, p.y0) * (1.0 - p.fy) + weight(p.x0, p.y1) * p.fy;
    const double right = weight(p.x1, p.y0) * (1.0 - p.fy) + weight(p.x1, p.y1) * p.fy;
    p.fx = sample_linear(ux, left, right);

    // Cells start at texel centers; those at the poles span half a row only
    double y = double(cell.row) - 0.5 + p.fy;
    if (cell.row == 0) y = 0.5 * p.fy;
    if (cell.row == height) y = double(height) - 0.5 + 0.5 * p.fy;
    const double theta = pi_d * y / double(height);
    const double sin_theta = std::sin(theta);
    if (!(sin_theta > 0.0)) return std::nullopt;
    const double pdf = density(p, cell.column, cell.row, sin_theta);
    if (!(pdf > 0.0)) return std::nullopt;
    double x = (double(cell.column) + 0.5 + p.fx) / double(width);
    if (x >= 1.0) x -= 1.0;
    return Sample{direction_of(theta, x), lookup(p), pdf};
}

}  // namespace velatura::lights
