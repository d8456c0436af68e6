// SPDX-License-Identifier: Apache-2.0
#pragma once

#include "display/film_preview.h"

#include <cstdint>
#include <string>

namespace velatura::display {

/// How a terminal takes images.
enum class TerminalProtocol : uint8_t { Kitty, Sixel };

/// What to write to a terminal so that it shows an image at the cursor, which stands at the start
/// of the line below it then.
///
/// Kitty: 24-bit RGB in base64, in pieces of 4,096 characters. Ref: kitty's "Terminal graphics
/// protocol". Sixel: a palette of 6 x 6 x 6 colors, ordered dither. Ref: DEC STD 070, chapter 9;
/// VT330/VT340 Programmer Reference Manual.
std::string terminal_image(TerminalProtocol protocol, const PreviewImage& image);

}  // namespace velatura::display
