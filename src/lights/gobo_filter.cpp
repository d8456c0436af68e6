// SPDX-License-Identifier: Apache-2.0
#include "lights/filter_shapes.h"

#include <algorithm>
#include <cmath>
#include <optional>
#include <utility>

namespace velatura::lights {
namespace {

class GoboLightFilter final : public LightFilter {
  public:
    GoboLightFilter(const scene::GoboFilter& gobo,
                    bool is_inverted,
                    std::shared_ptr<const EnvironmentImage> image)
        : gobo_(gobo), is_inverted_(is_inverted), image_(std::move(image)) {
        const double angle = double(gobo.rotation_deg) * pi_d / 180.0;
        cosine_ = std::cos(angle);
        sine_ = std::sin(angle);
        for (const Rgb& texel : image_->texels) max_texel_ = std::max(max_texel_, shown(texel));
        max_texel_ = std::max(max_texel_, shown(gobo.fill));
    }

    FilterEffect effect(const FilterSegment& segment) const override {
        const std::optional<PlaneCrossing> at = plane_crossing(gobo_.projection, segment);
        if (!at) return {Rgb(1.0f), 0.0f};
        const Rgb color = at->is_black ? gobo_.fill : lookup(at->point);
        return {is_inverted_ ? inverted(color) : color, 1.0f};
    }

    float max_pattern() const override { return max_texel_; }

  private:
    float shown(const Rgb& color) const {
        return luminance(is_inverted_ ? inverted(color) : color);
    }

    Rgb lookup(const Vec2d& p) const {
        // Turning the texture one way is turning the point the other way
        const Vec2d q(p.x * cosine_ + p.y * sine_, p.y * cosine_ - p.x * sine_);
        double u =
            q.x / double(gobo_.width) * double(gobo_.uv_scale.x) + 0.5 + double(gobo_.uv_offset.x);
        double v =
            q.y / double(gobo_.height) * double(gobo_.uv_scale.y) + 0.5 + double(gobo_.uv_offset.y);
        using Outside = scene::GoboFilter::Outside;
        // Written so that NaN, of points at infinity, is outside
        if (gobo_.outside == Outside::Fill && !(u >= 0.0 && u <= 1.0 && v >= 0.0 && v <= 1.0))
            return gobo_.fill;
        if (gobo_.outside == Outside::Repeat) {
            u -= std::floor(u);
            v -= std::floor(v);
        }
        if (!std::isfinite(u) || !std::isfinite(v)) return gobo_.fill;
        u = std::clamp(u, 0.0, 1.0);
        v = std::clamp(v, 0.0, 1.0);
        return bilinear(u * image_->width - 0.5, (1.0 - v) * image_->height - 0.5);
    }

    /// Between the centers of texels; x, y in texels from the center of the first, which is in the
    /// top left corner.
    Rgb bilinear(double x, double y) const {
        const double left = std::floor(x), top = std::floor(y);
        const auto fx = float(x - left), fy = float(y - top);
        const Rgb upper = texel(left, top) * (1.0f - fx) + texel(left + 1.0, top) * fx;
        const Rgb lower = texel(left, top + 1.0) * (1.0f - fx) + texel(left + 1.0, top + 1.0) * fx;
        return upper * (1.0f - fy) + lower * fy;
    }

    const Rgb& texel(double x, double y) const {
        const int column = wrapped(int(x), image_->width), row = wrapped(int(y), image_->height);
        return image_->texels[size_t(row) * size_t(image_->width) + size_t(column)];
    }

    int wrapped(int i, int count) const {
        if (gobo_.outside == scene::GoboFilter::Outside::Repeat)
            return ((i % count) + count) % count;
        return std::clamp(i, 0, count - 1);
    }

    scene::GoboFilter gobo_;
    bool is_inverted_;
    std::shared_ptr<const EnvironmentImage> image_;
    double cosine_ = 1.0, sine_ = 0.0;
    float max_texel_ = 0.0f;
};

}  // namespace

std::unique_ptr<LightFilter> make_gobo_filter(const scene::GoboFilter& shape,
                                              bool is_inverted,
                                              std::shared_ptr<const EnvironmentImage> image) {
    if (!image) return nullptr;
    return std::make_unique<GoboLightFilter>(shape, is_inverted, std::move(image));
}

}  // namespace velatura::lights
