# solenoid_embed_texts(<target> <files...> [ALIASED <folder> <files...>]): the files' contents inside the target, so that an
# installed program needs no data folder. Names are relative to a system's data/, or to the calling folder itself;
# those after ALIASED are <folder>/<file's own name>.
# experiments/base/embedded.hpp declares how to read them.
function(solenoid_embed_texts target)
  cmake_parse_arguments(arg "" "" "ALIASED" ${ARGN})
  list(POP_FRONT arg_ALIASED folder)
  set(cases "")
  set(names "")
  foreach(file IN LISTS arg_UNPARSED_ARGUMENTS arg_ALIASED)
    set_property(DIRECTORY APPEND PROPERTY CMAKE_CONFIGURE_DEPENDS ${file})
    file(READ ${file} text)
    file(RELATIVE_PATH name ${CMAKE_CURRENT_SOURCE_DIR} ${file})
    string(REGEX REPLACE "^systems/[a-z_]+/data/" "" name ${name})
    if(file IN_LIST arg_ALIASED)
      get_filename_component(name ${file} NAME)
      string(PREPEND name ${folder}/)
    endif()
    string(APPEND cases "  if (name == \"${name}\") return R\"_text_(${text})_text_\";\n")
    string(APPEND names "\"${name}\", ")
  endforeach()
  set(generated ${CMAKE_CURRENT_BINARY_DIR}/embedded.cpp)
  file(CONFIGURE OUTPUT ${generated} @ONLY CONTENT [[
#include <string>
#include <string_view>
#include <vector>

namespace solenoid {

std::string_view built_in_text(std::string_view name) {
@cases@  return {};
}

const std::vector<std::string>& built_in_names() {
  static const std::vector<std::string> names = {@names@};
  return names;
}

}  // namespace solenoid
]])
  target_sources(${target} PRIVATE ${generated})
endfunction()
