// SPDX-License-Identifier: Apache-2.0
#include "compositor/window/levels.h"

#include "base/tasks.h"
#include "compositor/io/input_files.h"
#include "compositor/io/row_values.h"

#include <fmt/format.h>

#include <algorithm>
#include <cmath>
#include <cstdint>
#include <set>

namespace velatura::compositor::window {

namespace {

/// Pixels that any machine mixes within a frame or two.
constexpr size_t quick_pixels = 150'000;
constexpr size_t smallest_pixels = 20'000;
/// Of an image, stored or not: 65,536 tiles.
constexpr size_t max_pixels = size_t(1) << 32;

bool is_mixed(const accumulate::LayerEntry& entry) {
    return entry.family != "halves" && entry.family != "data" && !entry.is_empty;
}

/// Full names of the channels that mixes add up, or that can be looked at.
std::set<std::string> used_channels(const LayerStack& stack) {
    std::set<std::string> names;
    for (const accumulate::LayerEntry& entry : stack.header().layers) {
        for (size_t c = 0; c < 3 && is_mixed(entry); ++c) {
            if (const image::Channel* channel = stack.channel(entry.name, c))
                names.insert(channel->name);
        }
    }
    for (const ShownLayer& layer : shown_layers(stack)) {
        for (const std::string& channel : layer.channels) {
            if (!channel.empty()) names.insert(channel);
        }
    }
    return names;
}

std::set<std::string> channels_not_finite(const image::Image& image) {
    std::vector<const image::Channel*> channels;
    for (const image::Part& part : image.parts) {
        for (const image::Channel& channel : part.channels) channels.push_back(&channel);
    }
    std::vector<uint8_t> has_some(channels.size(), 0);
    parallel_for(channels.size(), [&](size_t i) {
        const image::Channel& c = *channels[i];
        if (c.type() == image::ChannelType::Uint) return;
        has_some[i] = find_not_finite({c.type(), c.bytes()}, 0, c.size()).count > 0;
    });
    std::set<std::string> names;
    for (size_t i = 0; i < channels.size(); ++i) {
        if (has_some[i]) names.insert(channels[i]->name);
    }
    return names;
}

/// What is stored of a channel, and the image that it belongs to.
template <class T>
struct Stored {
    const std::vector<T>& values;
    const image::Window& window;
    const image::Window& frame;
};

/// The mean of those of the four pixels that the image has.
template <class T>
float careful_mean(const Stored<T>& from, int x, int y) {
    float sum = 0;
    int count = 0;
    for (int k = 0; k < 4; ++k) {
        const int fx = x + k % 2, fy = y + k / 2;
        if (!from.frame.contains(fx, fy)) continue;
        ++count;
        if (from.window.contains(fx, fy)) sum += float(from.values[from.window.index(fx, fy)]);
    }
    return sum / float(count);
}

/// Numbers that name something have no mean: that of the first pixel.
void average(const Stored<uint32_t>& from,
             std::vector<uint32_t>& to,
             const image::Window& to_window) {
    for (int y = to_window.y0; y < to_window.y1; ++y) {
        for (int x = to_window.x0; x < to_window.x1; ++x) {
            const int fx = from.frame.x0 + 2 * x, fy = from.frame.y0 + 2 * y;
            to[to_window.index(x, y)] =
                from.window.contains(fx, fy) ? from.values[from.window.index(fx, fy)] : 0;
        }
    }
}

template <class T>
void average(const Stored<T>& from, std::vector<T>& to, const image::Window& to_window) {
    const auto has = [&](int x, int y) {
        return from.frame.contains(x, y) && from.window.contains(x, y);
    };
    const auto stride = size_t(from.window.width());
    for (int y = to_window.y0; y < to_window.y1; ++y) {
        for (int x = to_window.x0; x < to_window.x1; ++x) {
            const int fx = from.frame.x0 + 2 * x, fy = from.frame.y0 + 2 * y;
            float mean = 0;
            if (has(fx, fy) && has(fx + 1, fy + 1)) {
                const T* four = from.values.data() + from.window.index(fx, fy);
                mean = (float(four[0]) + float(four[1]) + float(four[stride]) +
                        float(four[stride + 1])) /
                       4;
            } else {
                mean = careful_mean(from, fx, fy);
            }
            to[to_window.index(x, y)] = T(mean);
        }
    }
}

int half_down(int v) {
    return v >= 0 ? v / 2 : -((1 - v) / 2);
}

}  // namespace

image::Image half_size(const LayerStack& stack) {
    const image::Image& in = stack.image();
    const image::Window& frame = in.display;
    image::Image out;
    out.attributes = in.attributes;
    out.pixel_aspect_ratio = in.pixel_aspect_ratio;
    out.display = {0, 0, (frame.width() + 1) / 2, (frame.height() + 1) / 2};
    // Of the stored pixels those within the image
    const image::Window inside = {
        std::max(in.data.x0, frame.x0) - frame.x0, std::max(in.data.y0, frame.y0) - frame.y0,
        std::min(in.data.x1, frame.x1) - frame.x0, std::min(in.data.y1, frame.y1) - frame.y0};
    out.data = {half_down(inside.x0), half_down(inside.y0), half_down(inside.x1 + 1),
                half_down(inside.y1 + 1)};
    if (out.data.is_empty()) out.data = {0, 0, 1, 1};

    const std::set<std::string> wanted = used_channels(stack);
    std::vector<std::pair<const image::Channel*, image::Channel*>> pairs;
    for (const image::Part& part : in.parts) {
        image::Part smaller;
        smaller.name = part.name;
        smaller.attributes = part.attributes;
        for (const image::Channel& channel : part.channels) {
            if (!wanted.contains(channel.name)) continue;
            smaller.channels.push_back(
                image::Channel::make(channel.name, channel.type(), out.data.pixel_count()));
        }
        out.parts.push_back(std::move(smaller));
    }
    for (size_t p = 0; p < in.parts.size(); ++p) {
        for (image::Channel& to : out.parts[p].channels)
            pairs.emplace_back(in.parts[p].find(to.name), &to);
    }
    parallel_for(pairs.size(), [&](size_t i) {
        auto& [from, to] = pairs[i];
        std::visit(
            [&, to = to](const auto& values) {
                using Values = std::decay_t<decltype(values)>;
                using T = typename Values::value_type;
                average(Stored<T>{values, in.data, frame}, std::get<Values>(to->data), out.data);
            },
            from->data);
    });
    return out;
}

Result<Levels> Levels::make(std::shared_ptr<const LayerStack> stack) {
    Levels levels;
    levels.stacks_.push_back(std::move(stack));
    levels.not_finite_ = channels_not_finite(levels.stack(0).image());
    levels.shown_ = shown_layers(levels.stack(0));
    const image::Window whole = levels.frame(0);
    levels.image_frame_ = whole;
    if (whole.pixel_count() > max_pixels)
        return Error{"too-large", fmt::format("an image of {} x {} pixels is too large to display",
                                              whole.width(), whole.height())};
    while (levels.frame(levels.count() - 1).pixel_count() > smallest_pixels) {
        auto smaller = LayerStack::from_image(
            half_size(*levels.stacks_.back()),
            levels.stack(0).is_plain() ? ForeignFiles::Plain : ForeignFiles::Reject,
            levels.stack(0).view());
        if (!smaller) return smaller.error();
        levels.stacks_.push_back(std::make_shared<const LayerStack>(std::move(*smaller)));
    }
    return levels;
}

Result<Levels> Levels::make_draft(std::shared_ptr<const LayerStack> stack,
                                  int reduction,
                                  int width,
                                  int height) {
    auto levels = make(std::move(stack));
    if (!levels) return levels;
    levels->reduction_ = reduction;
    levels->image_frame_ = {0, 0, width, height};
    return levels;
}

Result<std::shared_ptr<const Levels>> load_levels(const std::vector<std::string>& paths,
                                                  const std::string& view) {
    auto stack = paths.size() == 1 ? LayerStack::load(paths[0], ForeignFiles::Plain, view)
                                   : load_input(paths, view);
    if (!stack) return stack.error();
    auto levels = Levels::make(std::make_shared<const LayerStack>(std::move(*stack)));
    if (!levels) return levels.error();
    return std::make_shared<const Levels>(std::move(*levels));
}

LevelPlans plans_by_level(const Levels& levels,
                          mix::MixPlan plan,
                          std::span<const LevelPlans> earlier) {
    LevelPlans plans;
    plans.push_back(std::make_shared<const mix::MixPlan>(std::move(plan)));
    // The values of the whole file are those of one matte, whatever its number in a plan
    const auto known = [&](const Matte& whole,
                           size_t level) -> std::shared_ptr<const std::vector<float>> {
        for (const LevelPlans& other : earlier) {
            const std::vector<Matte>& mattes = other[0]->mattes;
            for (size_t m = 0; m < mattes.size(); ++m) {
                if (mattes[m].values == whole.values) return other[level]->mattes[m].values;
            }
        }
        return nullptr;
    };
    while (plans.size() < levels.count()) {
        if (plans[0]->mattes.empty()) {
            plans.push_back(plans[0]);
            continue;
        }
        const image::Image& from = levels.stack(plans.size() - 1).image();
        const image::Window& window = levels.stack(plans.size()).image().data;
        mix::MixPlan smaller = *plans.back();
        for (size_t m = 0; m < smaller.mattes.size(); ++m) {
            Matte& matte = smaller.mattes[m];
            if (auto values = known(plans[0]->mattes[m], plans.size())) {
                matte.values = std::move(values);
                continue;
            }
            std::vector<float> values(window.pixel_count());
            average(Stored<float>{*matte.values, from.data, from.display}, values, window);
            matte.values = std::make_shared<const std::vector<float>>(std::move(values));
        }
        plans.push_back(std::make_shared<const mix::MixPlan>(std::move(smaller)));
    }
    return plans;
}

image::Window Levels::frame(size_t level) const {
    const image::Window& display = stack(level).image().display;
    return {0, 0, display.width(), display.height()};
}

size_t Levels::level_for(double scale) const {
    size_t level = 0;
    while (level + 1 < count() && std::ldexp(scale * reduction_, int(level) + 1) <= 1) ++level;
    return level;
}

size_t Levels::quick_level() const {
    size_t level = 0;
    while (level + 1 < count() && frame(level).pixel_count() > quick_pixels) ++level;
    return level;
}

}  // namespace velatura::compositor::window
