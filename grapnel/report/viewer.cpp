#include "grapnel/report/report_html.hpp"

#ifdef GRAPNEL_HAS_VIEWER
// In viewer.S, which CMake makes.
extern "C" const char grapnel_viewer_script[], grapnel_viewer_script_end[];
extern "C" const char grapnel_viewer_style[], grapnel_viewer_style_end[];
#endif

namespace grapnel {

Viewer embedded_viewer() {
#ifdef GRAPNEL_HAS_VIEWER
  return {{grapnel_viewer_script, grapnel_viewer_script_end}, {grapnel_viewer_style, grapnel_viewer_style_end}};
#else
  return {};
#endif
}

}  // namespace grapnel
