// SPDX-License-Identifier: Apache-2.0
#pragma once

namespace velatura::compositor {
inline namespace io {

/// Header strings of files that the compositor writes, beside those of layers/layer_header.h.
inline constexpr const char* mix_attribute = "velatura/mix";          ///< the look
inline constexpr const char* denoise_attribute = "velatura/denoise";  ///< how it was filtered

}  // namespace io
}  // namespace velatura::compositor
