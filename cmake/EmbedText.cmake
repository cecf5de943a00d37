# solenoid_embed_texts(<target> <files...>): the files' contents inside the target, so that an installed program needs no
# data folder. Names are relative to the calling folder; experiments/embedded.hpp declares how to read them.
function(solenoid_embed_texts target)
  set(cases "")
  set(names "")
  foreach(file IN LISTS ARGN)
    set_property(DIRECTORY APPEND PROPERTY CMAKE_CONFIGURE_DEPENDS ${file})
    file(READ ${file} text)
    file(RELATIVE_PATH name ${CMAKE_CURRENT_SOURCE_DIR} ${file})
    string(APPEND cases "  if (name == \"${name}\") return R\"_text_(${text})_text_\";\n")
    string(APPEND names "\"${name}\", ")
  endforeach()
  set(generated ${CMAKE_CURRENT_BINARY_DIR}/embedded.cpp)
  file(CONFIGURE OUTPUT ${generated} @ONLY CONTENT [[
#include "experiments/embedded.hpp"

namespace solenoid {

std::string_view embedded_text(std::string_view name) {
@cases@  return {};
}

const std::vector<std::string>& embedded_names() {
  static const std::vector<std::string> names = {@names@};
  return names;
}

}  // namespace solenoid
]])
  target_sources(${target} PRIVATE ${generated})
endfunction()
