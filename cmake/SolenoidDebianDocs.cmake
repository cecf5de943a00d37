# What Debian wants below share/doc/<package>: whose the files are, and what changed.
set(SOLENOID_DEBIAN_MAINTAINER "The Solenoid developers <solenoid@localhost>")

# In the machine-readable form of `copyright` a licence's text is indented, and an empty line is a dot.
function(solenoid_indented_text file out)
  file(READ ${file} text)
  string(STRIP "${text}" text)
  string(REGEX REPLACE "[ \t]+\n" "\n" text "${text}")
  string(REGEX REPLACE "\n" "\n " text "${text}")
  string(REGEX REPLACE "\n \n" "\n .\n" text "${text}")
  string(REGEX REPLACE "\n \n" "\n .\n" text "${text}")
  set(${out} " ${text}" PARENT_SCOPE)
endfunction()

function(solenoid_write_copyright file)
  solenoid_indented_text(${PROJECT_SOURCE_DIR}/LICENSE licence)
  string(REGEX MATCH "Copyright \\(c\\) ([^\n]+)" copyright "${licence}")
  set(text "Format: https://www.debian.org/doc/packaging-manuals/copyright-format/1.0/
Upstream-Name: solenoid
Comment: Notices of the headers that are compiled in stand in the file notices beside this one.

Files: *
Copyright: ${CMAKE_MATCH_1}
License: BSD-3-Clause
${licence}
")
  if(SOLENOID_UPLOT AND EXISTS ${SOLENOID_UPLOT}/../LICENSE)
    solenoid_indented_text(${SOLENOID_UPLOT}/../LICENSE licence)
    string(REGEX MATCH "Copyright \\(c\\) ([^\n]+)" copyright "${licence}")
    string(APPEND text "
Files: node_modules/uplot/*
Comment: uPlot is text inside the program and the Python package, and is written into every report.
Copyright: ${CMAKE_MATCH_1}
License: Expat
${licence}
")
  endif()
  file(WRITE ${file} "${text}")
endfunction()

# Notices of what is compiled into the binaries (docs/reference/licences.md), as Debian's packages of it have them.
function(solenoid_write_notices file)
  set(text "Parts of these headers are compiled into Solenoid's binaries. Their notices, as their Debian packages have them:

This product includes software developed by the University of Chicago, as Operator of Argonne National Laboratory
(Minpack, in Eigen). Eigen's source is to be had from Debian, package eigen3.
")
  foreach(package libeigen3-dev libxsimd-dev libfmt-dev libspdlog-dev libcli11-dev libtomlplusplus-dev nlohmann-json3-dev
                  libboost-dev pybind11-dev)
    if(EXISTS /usr/share/doc/${package}/copyright)
      file(READ /usr/share/doc/${package}/copyright notice)
      string(REPEAT "=" 100 rule)
      string(APPEND text "\n${rule}\n${package}\n${rule}\n\n${notice}")
    endif()
  endforeach()
  file(WRITE ${file}.new "${text}")
  file(COPY_FILE ${file}.new ${file} ONLY_IF_DIFFERENT)
endfunction()

# The changelog of a package without a Debian revision, dated as the commit is: the same commit packs the same file.
function(solenoid_write_changelog package file)
  set(date "")
  if(GIT_FOUND)
    execute_process(COMMAND ${GIT_EXECUTABLE} log -1 --format=%cD WORKING_DIRECTORY ${PROJECT_SOURCE_DIR}
                    OUTPUT_VARIABLE date OUTPUT_STRIP_TRAILING_WHITESPACE ERROR_QUIET)
  endif()
  if(NOT date)
    string(TIMESTAMP date "%a, %d %b %Y %H:%M:%S +0000" UTC)
  endif()
  file(WRITE ${file} "${package} (${PROJECT_VERSION}) unstable; urgency=medium

  * Release ${PROJECT_VERSION}; CHANGELOG.md in the sources says what changed.

 -- ${SOLENOID_DEBIAN_MAINTAINER}  ${date}
")
  execute_process(COMMAND gzip -9nf ${file} COMMAND_ERROR_IS_FATAL ANY)
endfunction()

# solenoid_debian_docs(<package> <component>): copyright, notices and changelog of the package, in its component.
function(solenoid_debian_docs package component)
  find_package(Git QUIET)
  set(folder ${PROJECT_BINARY_DIR}/debian/${package})
  file(MAKE_DIRECTORY ${folder})
  solenoid_write_copyright(${folder}/copyright)
  solenoid_write_notices(${folder}/notices)
  solenoid_write_changelog(${package} ${folder}/changelog)
  install(FILES ${folder}/copyright ${folder}/notices ${folder}/changelog.gz
          DESTINATION ${CMAKE_INSTALL_DATADIR}/doc/${package} COMPONENT ${component})
endfunction()
