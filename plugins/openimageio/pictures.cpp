// SPDX-License-Identifier: Apache-2.0
#include "plugins/openimageio/pictures.h"

#include "plugins/openimageio/asset_image.h"

#include <OpenImageIO/imageio.h>

#include <exception>
#include <new>
#include <utility>

namespace velatura::plugins::openimageio {

namespace {

class OpenPicture final : public image::Picture {
  public:
    explicit OpenPicture(AssetImage input) : input_(std::move(input)) {
        const OIIO::ImageSpec& spec = input_->spec();
        facts_.width = spec.width;
        facts_.height = spec.height;
        facts_.channels = spec.nchannels;
        facts_.is_floating_point = spec.format.is_floating_point();
        facts_.color_space = spec.get_string_attribute("oiio:ColorSpace");
    }

    const image::PictureFacts& facts() const override { return facts_; }

    Result<void> read(int channels, std::span<float> values) override {
        try {
            if (input_->read_image(0, 0, 0, channels, OIIO::TypeDesc::FLOAT, values.data()))
                return {};
            return Error{"image-read", one_line(input_->geterror())};
        } catch (const std::bad_alloc&) {
            throw;
        } catch (const std::exception& e) {
            return Error{"image-read", e.what()};
        }
    }

  private:
    AssetImage input_;
    image::PictureFacts facts_;
};

}  // namespace

Result<std::unique_ptr<image::Picture>> Pictures::open(const std::string& asset) const {
    try {
        Result<AssetImage> input = open_asset_image(asset);
        if (!input) return input.error();
        return std::unique_ptr<image::Picture>(new OpenPicture(std::move(*input)));
    } catch (const std::bad_alloc&) {
        throw;
    } catch (const std::exception& e) {
        return Error{"image-open", e.what()};
    }
}

Result<void> Pictures::write(const std::string& file,
                             int width,
                             int height,
                             std::span<const uint8_t> rgb) const {
    const auto error = [](const std::string& why) { return Error{"io-write", one_line(why)}; };
    try {
        const auto output = OIIO::ImageOutput::create(file);
        if (!output) return error(OIIO::geterror());
        OIIO::ImageSpec spec(width, height, 3, OIIO::TypeDesc::UINT8);
        spec.attribute("oiio:ColorSpace", "sRGB");
        spec.attribute("Compression", "jpeg:95");
        if (!output->open(file, spec)) return error(output->geterror());
        if (!output->write_image(OIIO::TypeDesc::UINT8, rgb.data()))
            return error(output->geterror());
        if (!output->close()) return error(output->geterror());
        return {};
    } catch (const std::exception& e) {
        return error(e.what());
    }
}

}  // namespace velatura::plugins::openimageio
