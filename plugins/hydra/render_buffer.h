// SPDX-License-Identifier: Apache-2.0
#pragma once

#include <pxr/base/gf/vec3i.h>
#include <pxr/imaging/hd/renderBuffer.h>

#include <atomic>
#include <cstdint>
#include <functional>
#include <mutex>
#include <span>
#include <vector>

namespace velatura::hydra {

/// The pixels of an AOV, row 0 at the bottom. Thread-safe: the renderer writes whole images while
/// the host maps them.
class RenderBuffer final : public PXR_NS::HdRenderBuffer {
  public:
    /// Args: detach: called before the pixels go; must end what writes into them.
    RenderBuffer(const PXR_NS::SdfPath& id, std::function<void(const RenderBuffer&)> detach);
    ~RenderBuffer() override;

    bool Allocate(const PXR_NS::GfVec3i& dimensions,
                  PXR_NS::HdFormat format,
                  bool is_multi_sampled) override;

    unsigned int GetWidth() const override { return unsigned(width_); }

    unsigned int GetHeight() const override { return unsigned(height_); }

    unsigned int GetDepth() const override { return 1; }

    PXR_NS::HdFormat GetFormat() const override { return format_; }

    bool IsMultiSampled() const override { return false; }

    void* Map() override;
    void Unmap() override;

    bool IsMapped() const override { return mappings_ > 0; }

    void Resolve() override {}

    bool IsConverged() const override { return is_converged_; }

    void set_converged(bool is_converged) { is_converged_ = is_converged; }

    /// Rows from the bottom of `components` numbers per pixel, converted to the buffer's format.
    /// Of another size than the buffer: nothing is written.
    void write(int width, int height, size_t components, std::span<const float> values);
    void write(int width, int height, std::span<const int32_t> values);

  protected:
    void _Deallocate() override;

  private:
    template <class Number>
    void write_numbers(int width, int height, size_t components, std::span<const Number> values);

    std::function<void(const RenderBuffer&)> detach_;
    std::recursive_mutex mutex_;  ///< of the pixels, held while they are mapped
    int width_ = 0, height_ = 0;
    PXR_NS::HdFormat format_ = PXR_NS::HdFormatInvalid;
    std::vector<uint8_t> pixels_;
    std::atomic<int> mappings_ = 0;
    std::atomic<bool> is_converged_ = false;
};

}  // namespace velatura::hydra
