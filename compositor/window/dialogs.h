// SPDX-License-Identifier: Apache-2.0
#pragma once

#include "compositor/window/drawing.h"
#include "compositor/window/folder_list.h"

#include <array>
#include <string>

namespace velatura::compositor::window {

/// Files to open and save, and the help about keys: one at a time, before everything else.
class Dialogs {
  public:
    void draw(Drawing& drawing);

  private:
    void begin(Drawing& drawing);
    void draw_help(Drawing& drawing);
    void draw_files(Drawing& drawing);
    void draw_replace(Drawing& drawing);
    void draw_quit(Drawing& drawing);
    void save(Drawing& drawing, Dialog what, const std::string& path);
    void draw_list(Drawing& drawing);
    void accept(Drawing& drawing);
    void go_to(const std::string& folder);

    Dialog shown_ = Dialog::None;
    OutputKind output_ = OutputKind::Image;
    FolderList list_;
    std::array<char, 4096> name_{};  ///< as typed
};

}  // namespace velatura::compositor::window
