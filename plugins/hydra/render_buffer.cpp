// SPDX-License-Identifier: Apache-2.0
#include "plugins/hydra/render_buffer.h"

#include <pxr/base/gf/half.h>
#include <pxr/imaging/hd/types.h>

#include <algorithm>
#include <cmath>
#include <cstring>
#include <utility>

namespace velatura::hydra {

using namespace PXR_NS;

namespace {

template <class To>
void put(uint8_t* pixel, size_t component, To value) {
    std::memcpy(pixel + component * sizeof(To), &value, sizeof(To));
}

/// The number in the format of one component.
template <class Number>
void put_number(HdFormat component_format, uint8_t* pixel, size_t component, Number value) {
    const auto as_float = [&] { return float(value); };
    switch (component_format) {
        case HdFormatInt32:
            put(pixel, component, int32_t(value));
            break;
        case HdFormatFloat32:
            put(pixel, component, as_float());
            break;
        case HdFormatFloat16:
            put(pixel, component, GfHalf(as_float()).bits());
            break;
        case HdFormatUNorm8:
            put(pixel, component,
                uint8_t(std::lround(std::clamp(as_float(), 0.0f, 1.0f) * 255.0f)));
            break;
        case HdFormatSNorm8:
            put(pixel, component,
                int8_t(std::lround(std::clamp(as_float(), -1.0f, 1.0f) * 127.0f)));
            break;
        default:
            break;
    }
}

}  // namespace

RenderBuffer::RenderBuffer(const SdfPath& id, std::function<void(const RenderBuffer&)> detach)
    : HdRenderBuffer(id), detach_(std::move(detach)) {}

RenderBuffer::~RenderBuffer() {
    detach_(*this);
}

bool RenderBuffer::Allocate(const GfVec3i& dimensions, HdFormat format, bool is_multi_sampled) {
    (void)is_multi_sampled;
    _Deallocate();
    if (dimensions[0] < 0 || dimensions[1] < 0 || dimensions[2] != 1) {
        TF_WARN("velatura: render buffer <%s> must have a depth of 1", GetId().GetText());
        return false;
    }
    const std::lock_guard lock(mutex_);
    width_ = dimensions[0];
    height_ = dimensions[1];
    format_ = format;
    pixels_.assign(size_t(width_) * size_t(height_) * HdDataSizeOfFormat(format), 0);
    return true;
}

void RenderBuffer::_Deallocate() {
    detach_(*this);
    const std::lock_guard lock(mutex_);
    width_ = height_ = 0;
    format_ = HdFormatInvalid;
    pixels_.clear();
    is_converged_ = false;
}

void* RenderBuffer::Map() {
    mutex_.lock();
    ++mappings_;
    return pixels_.data();
}

void RenderBuffer::Unmap() {
    --mappings_;
    mutex_.unlock();
}

template <class Number>
void RenderBuffer::write_numbers(int width,
                                 int height,
                                 size_t components,
                                 std::span<const Number> values) {
    const std::lock_guard lock(mutex_);
    if (width != width_ || height != height_ || format_ == HdFormatInvalid) return;
    const HdFormat component_format = HdGetComponentFormat(format_);
    const size_t stored = HdGetComponentCount(format_), size = HdDataSizeOfFormat(format_);
    const size_t pixels = size_t(width) * size_t(height);
    for (size_t i = 0; i < pixels; ++i) {
        for (size_t c = 0; c < stored; ++c) {
            // What has fewer components is opaque
            const Number otherwise = c == 3 ? Number(1) : Number(0);
            put_number(component_format, &pixels_[i * size], c,
                       c < components ? values[i * components + c] : otherwise);
        }
    }
}

void RenderBuffer::write(int width, int height, size_t components, std::span<const float> values) {
    write_numbers(width, height, components, values);
}

void RenderBuffer::write(int width, int height, std::span<const int32_t> values) {
    write_numbers(width, height, 1, values);
}

}  // namespace velatura::hydra
