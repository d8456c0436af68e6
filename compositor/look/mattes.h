// SPDX-License-Identifier: Apache-2.0
#pragma once

#include "base/result.h"
#include "compositor/io/layer_stack.h"
#include "layers/cryptomatte.h"

#include <cstddef>
#include <cstdint>
#include <memory>
#include <optional>
#include <string>
#include <vector>

namespace velatura::compositor {
inline namespace look {

/// How far a control reaches into each pixel, 0 … 1.
struct Matte {
    std::string text;                                  ///< as typed
    std::shared_ptr<const std::vector<float>> values;  ///< [pixel of the data window]
    /// What is wrong with the Cryptomatte, or that no pixel has what was asked for.
    std::vector<std::string> notes = {};
};

/// Reads what `--matte` names: `LAYER:PATTERN,PATTERN …` cuts a Cryptomatte of the file
/// (layers/cryptomatte.h; LAYER may be `object` or `material`; a comma within a name is `\,` unless
/// the name is all there is), `FILE.exr:CHANNEL` takes a channel
/// of an image over the same pixels; `!` before either turns it inside out. Values are clamped to
/// [0, 1]; those that are not finite count as 0. `file` is needed where the stack has no pixels.
/// Files are read in strips of at most `strip_bytes`.
/// Errors: "bad-matte" (usage), "matte-layer", "matte-name", "matte-channel", "matte-window",
/// "io-open", "io-read".
Result<Matte> load_matte(const LayerStack& stack,
                         const layers::StripReader* file,
                         const std::string& text,
                         size_t strip_bytes = size_t(1) << 30);

/// What `--matte` takes of a Cryptomatte.
struct MatteIds {
    bool is_inverted = false;
    layers::Cryptomatte matte;
    std::vector<uint32_t> ids;
};

/// None where an image is named. Errors as load_matte.
Result<std::optional<MatteIds>> matte_ids_of(const LayerStack& stack, const std::string& text);

}  // namespace look
}  // namespace velatura::compositor
