// SPDX-License-Identifier: Apache-2.0
#include "plugin/registry.h"
#include "python/bindings.h"
#include "python/conversions.h"
#include "python/keywords.h"

#include <dlfcn.h>
#include <pybind11/stl.h>

#include <filesystem>
#include <string>
#include <string_view>

namespace py = pybind11;

namespace velatura::python {

namespace {

/// The root of the tree, built or installed, that this module lies in: plugins are below it.
void find_plugins() {
    Dl_info module{};
    static const char here = 0;
    if (::dladdr(&here, &module) == 0 || !module.dli_fname) return;
    std::error_code failed;
    const std::filesystem::path file = std::filesystem::canonical(module.dli_fname, failed);
    if (failed) return;
    const std::string folder = file.parent_path().string();
    for (const std::string_view place : {VELATURA_PYTHON_BUILT, VELATURA_PYTHON_INSTALLED}) {
        const std::string tail = "/" + std::string(place);
        if (folder.ends_with(tail))
            return plugin::set_program_root(folder.substr(0, folder.size() - tail.size()));
    }
}

}  // namespace

}  // namespace velatura::python

PYBIND11_MODULE(_native, module) {
    using namespace velatura::python;
    module.doc() = "What the package velatura is made of.";
    find_plugins();
    translate_failures();
    add_stage(module);
    add_builder(module);
    add_render(module);
    LayersClass layers = add_layers(module);
    add_mix(module, layers);
    module.attr("__version__") = VELATURA_VERSION;
    module.def("render_options", &render_keywords,
               "Names of all options of `render` and `Renderer`.");
}
