# nook-report from the outside:
#   cmake -DREPORT=path/to/nook-report [-DWORK_DIR=folder] -P report_cli.cmake
# Works in the folder, which it makes anew.

cmake_minimum_required(VERSION 3.25)

set(PROGRAM ${REPORT})
include(${CMAKE_CURRENT_LIST_DIR}/cli.cmake)

# check("what should be so" [[condition of if()]])
function(check claim condition)
    cmake_language(EVAL CODE "
        if(NOT (${condition}))
            message(SEND_ERROR [==[not so: ${claim}]==])
        endif()")
endfunction()

# --- what is refused ------------------------------------------------------------------------------

set(triangle "v 0 0 0\nv 1 0 0\nv 0 1 0\nf 1 2 3\n")
file(WRITE ${work}/good.obj "${triangle}")
file(WRITE ${work}/empty.obj "")
file(WRITE ${work}/truncated.obj "v 0 0 0\nv 1 0 0\nv 0 1 0\nf 1 2")
file(WRITE ${work}/nonsense.obj "not a mesh at all\n")
file(WRITE ${work}/range.obj "v 0 0 0\nv 1 0 0\nv 0 1 0\nf 1 2 4\n")
file(WRITE ${work}/flat.obj "v 0 0 0\nv 1 0 0\nv 2 0 0\nf 1 2 3\n")
file(WRITE ${work}/file "")

refuse("missing.obj" missing.obj)
refuse("empty.obj" empty.obj)
refuse("truncated.obj: line 4" truncated.obj)
refuse("nonsense.obj: line 1" nonsense.obj)
refuse("range.obj: line 4" range.obj)
refuse("flat.obj: no triangle is left" flat.obj)
refuse("range.obj" good.obj range.obj)
refuse("is a folder" .)
if(EXISTS /dev/null)
    refuse("/dev/null: is not a regular file" /dev/null)
endif()
refuse("file" good.obj --out file)
refuse("file" good.obj --out file/below)
refuse("--out" good.obj --out "")
foreach(size 0x540 960x0 100000x100000 32768x32768 -1x5 960 960x 960x540x2 axb 1e2x5 " ")
    refuse("--size" good.obj --size ${size})
endforeach()
foreach(radius nan inf -inf 0 -1 1e999 five "")
    refuse("--radius" good.obj --radius "${radius}")
endforeach()
foreach(count 0 1 -5 1.5 many 99999999999999999999 "")
    refuse("--rays" good.obj --rays "${count}")
endforeach()
foreach(count 0 -1 x 1000000)
    refuse("--threads" good.obj --threads ${count})
endforeach()
foreach(camera 1,2,3 1,2,3,4,5 1,2,3,1,2,3 0,0,1,0,0,nan 0,0,1,0,0,0,0 0,0,1,0,0,0,180 0,0,1,0,0,0,45,1 a,b,c,d,e,f "")
    refuse("--camera" good.obj --camera "${camera}")
endforeach()
# Each number is sound, and the view is not.
refuse("camera.view_height" good.obj --ortho --camera 0,0,1e300,0,0,0)
refuse("frame" good.obj --camera 1e308,0,0,-1e308,0,0)
refuse("projection.f" good.obj --camera 0,0,1,0,0,0,1e-305)
# In the way of what a run writes at its end.
foreach(name report.json report.csv index.html)
    file(MAKE_DIRECTORY ${work}/taken-${name}/${name})
    refuse("${name}: is a folder" good.obj --out taken-${name})
endforeach()
file(MAKE_DIRECTORY ${work}/blocked/cells)
file(WRITE ${work}/blocked/cells/floor "")
refuse("floor: is not a folder" good.obj --scene floor --size 8x8 --rays 2 --out blocked)
# What another report is held against.
file(WRITE ${work}/nonsense.json "{\"format\": 2")
file(WRITE ${work}/other.json "{\"format\": 1}")
refuse("missing.json" good.obj --compare missing.json)
refuse("--compare" good.obj --compare "")
refuse("nonsense.json: is no JSON" good.obj --compare nonsense.json)
refuse("other.json" good.obj --compare other.json)
foreach(option --error-tolerance --time-tolerance)
    refuse("${option}" good.obj ${option} 0.1)
    foreach(value -1 nan inf x "")
        refuse("${option}" good.obj --compare other.json ${option} "${value}")
    endforeach()
endforeach()
refuse("--scene" --scene nowhere)
refuse("--unknown" --unknown)
refuse("-q" -q)
refuse("--rays" good.obj --rays)

# --- what is answered without work ----------------------------------------------------------------

run(--help)
check("--help succeeds" [[status EQUAL 0 AND err STREQUAL ""]])
foreach(option --scene --quick --size --camera --ortho --radius --rays --threads --out --compare
        --error-tolerance --time-tolerance --list 640x360 2048 "5 %" "median depth" "odd, at most 255"
        "never deleted")
    string(FIND "${out}" "${option}" at)
    check("--help tells of ${option}" [[NOT at EQUAL -1]])
endforeach()
run(--list)
check("--list succeeds" [[status EQUAL 0]])
foreach(scene bowl boxes stairs chains terrain floor curtain arcade temple city corridor cup tree lathe empty)
    string(FIND "${out}" "${scene}" at)
    check("--list has ${scene}" [[NOT at EQUAL -1]])
endforeach()

# --- what is done ---------------------------------------------------------------------------------

# found("what" "in a text")
function(found word text)
    string(FIND "${text}" "${word}" at)
    check("there is '${word}' in: ${text}" [[NOT at EQUAL -1]])
endfunction()

set(small --size 64x36 --rays 8 --threads 2 --quick)
file(APPEND ${work}/good.obj "v nan 0 0\nf 1 2 4\nf 1 1 2\n")
run(good.obj good.obj --scene bowl floor --scene empty ${small} --out out)
check("a small run succeeds: ${err}" [[status EQUAL 0]])
check("nothing on stderr without a terminal" [[err STREQUAL ""]])
foreach(word chebyshev-window horizon traced information-visibility "5 scenes, 7 parts: about" "report.csv: out")
    found("${word}" "${out}")
endforeach()
foreach(file index.html report.json report.csv)
    check("${file} is there" "EXISTS ${work}/out/${file}")
endforeach()

file(READ ${work}/out/report.json json)
foreach(member cpu compiler threads)
    string(JSON ignored GET "${json}" machine ${member})
endforeach()
string(JSON command GET "${json}" run command)
check("the command: ${command}" [[command MATCHES "^nook-report good.obj good.obj --scene bowl floor"]])
string(JSON count LENGTH "${json}" cells)
check("seven cells in report.json" [[count EQUAL 7]])
set(ids "")
foreach(index RANGE 6)
    # Each look into a text parses all of it: parts are taken out first.
    string(JSON cell_${index} GET "${json}" cells ${index})
    string(JSON id GET "${cell_${index}}" id)
    list(APPEND ids ${id})
    set(kernels_${index} "")
    string(JSON count LENGTH "${cell_${index}}" results)
    math(EXPR last "${count} - 1")
    foreach(number RANGE ${last})
        string(JSON result GET "${cell_${index}}" results ${number})
        string(JSON kernel GET "${result}" kernel)
        string(JSON name GET "${result}" id)
        list(APPEND kernels_${index} ${kernel})
        check("${id}/${name}.jpg" "EXISTS ${work}/out/cells/${id}/${name}.jpg")
        foreach(member rmse mae bias p99 max ssim fitted_rmse rank_correlation)
            string(JSON value TYPE "${result}" error ${member})
            check("error.${member} is a number" [[value STREQUAL "NUMBER"]])
        endforeach()
        # The range check per sample may cut windows of a slanted floor one-sidedly.
        if(id STREQUAL "floor" AND NOT kernel STREQUAL "chebyshev-range-exact")
            string(JSON rmse GET "${result}" error rmse)
            check("nothing occludes on the floor: ${kernel}" [[rmse EQUAL 0]])
        endif()
    endforeach()
endforeach()
check("meshes of one name are told apart: ${ids}"
    [[ids STREQUAL "good;good-unlimited;good-2;good-2-unlimited;bowl;floor;empty"]])
foreach(kernel chebyshev-window chebyshev-radius chebyshev-range chebyshev-range-exact alchemy
        alchemy-blurred alchemy-half scalable horizon horizon-blurred bitmask masked stand-alone traced)
    check("${kernel} ran on the bowl: ${kernels_4}" "${kernel} IN_LIST kernels_4")
endforeach()
check("screens have a radius: ${kernels_1}" [[NOT alchemy IN_LIST kernels_1]])
check("the viewpoints saw the mesh: ${kernels_1}" [[information-pmi IN_LIST kernels_1]])
foreach(picture shaded depth normals reference-visibility height-field height-field-error alchemy-16
        alchemy-16-composed alchemy-16-error)
    check("${picture}.png of the bowl" "EXISTS ${work}/out/cells/bowl/${picture}.png")
endforeach()
foreach(figure 2 4)
    check("figure ${figure} of the bowl" "EXISTS ${work}/out/cells/bowl/figure-${figure}.png")
endforeach()
foreach(index 4 5)
    string(JSON traced GET "${cell_${index}}" references 0 rays)
    string(JSON skipped GET "${cell_${index}}" references 0 skipped_rays)
    math(EXPR all "${traced} + ${skipped}")
    check("all rays of a full picture: 64 x 36 x 8" [[all EQUAL 18432]])
endforeach()
string(JSON share GET "${cell_6}" background_share)
check("the empty view is background alone" [[share EQUAL 1]])
string(JSON dropped GET "${cell_0}" dropped_triangles)
check("two bad triangles" [[dropped EQUAL 2]])
file(GLOB_RECURSE leftovers ${work}/*.tmp)
check("no temporary file is left: ${leftovers}" [[leftovers STREQUAL ""]])

# --- what was measured before ---------------------------------------------------------------------

run(good.obj good.obj --scene bowl floor empty ${small} --out out --compare out/report.json)
check("the same again: ${err}" [[status EQUAL 0]])
found("7 of them measured before" "${out}")
file(READ ${work}/out/report.json again)
string(JSON before GET "${json}" cells)
string(JSON after GET "${again}" cells)
check("nothing was measured twice" [[before STREQUAL after]])
run(good.obj --scene bowl ${small} --radius 2 --out out)
found("2 scenes, 2 parts: about" "${out}")
file(WRITE ${work}/out/cells/bowl/measured.json "{")
run(good.obj --scene bowl floor ${small} --out out)
check("what is no good is measured again: ${err}" [[status EQUAL 0]])

# An error that was smaller before, and one that was larger.
string(JSON rmse GET "${cell_4}" results 0 error rmse)
foreach(before 0 9)
    string(JSON altered SET "${json}" cells 4 results 0 error rmse ${before})
    file(WRITE ${work}/altered.json "${altered}")
    run(good.obj good.obj --scene bowl floor empty ${small} --out out --time-tolerance 1000
        --compare altered.json)
    math(EXPR expected "1 - ${before} / 9")
    check("status ${status} where the error was ${before}: ${err}" [[status EQUAL expected]])
endforeach()

# Killed after its first part, a run goes on with the second.
find_program(SH sh)
if(SH)
    execute_process(COMMAND ${SH} -c "
        '${PROGRAM}' --scene floor boxes --size 160x90 --rays 256 --quick --out killed &
        until [ -e killed/cells/boxes/measured.json ]; do sleep 0.02; done
        kill -9 $!
        wait $!
        [ ! -e killed/report.json ] || echo finished" WORKING_DIRECTORY ${work} OUTPUT_VARIABLE killed)
    check("a killed run leaves no report: ${killed}" [[NOT killed MATCHES "finished"]])
    run(--scene floor boxes --size 160x90 --rays 256 --quick --out killed)
    check("a killed run is taken up: ${err}" [[status EQUAL 0]])
    found("1 of them measured before" "${out}")
    check("its report is there" "EXISTS ${work}/killed/report.json")

    # A disk that takes no file above 2 kB.
    execute_process(COMMAND ${SH} -c "
        trap '' XFSZ
        ulimit -f 4
        exec '${PROGRAM}' --scene floor --size 160x90 --rays 8 --quick --out full"
        WORKING_DIRECTORY ${work} RESULT_VARIABLE status OUTPUT_VARIABLE out ERROR_VARIABLE err)
    check("status ${status} on a full disk" [[status EQUAL 2]])
    string(REGEX MATCHALL "\n" lines "${err}")
    check("one line that names the file: ${err}" [[lines STREQUAL "\n" AND err MATCHES "full/cells/floor/"]])
    file(GLOB_RECURSE leftovers ${work}/full/*.tmp ${work}/full/report.* ${work}/full/index.html)
    check("nothing half-written on a full disk: ${leftovers}" [[leftovers STREQUAL ""]])
endif()

# --- what else may be asked for ---------------------------------------------------------------------

run(good.obj --ortho --camera 0,0,5,0.3,0.3,0,30 --radius 0.5 --size 1x1 --rays 3 --threads 1 --quick --out one)
check("one pixel, orthographic: ${err}" [[status EQUAL 0]])
file(READ ${work}/one/report.json json)
string(JSON directions GET "${json}" run directions)
check("rays are rounded up to an even number" [[directions EQUAL 4]])

configure_file(${work}/good.obj ${work}/bowl.obj COPYONLY)
configure_file(${work}/good.obj ${work}/stability.obj COPYONLY)
run(bowl.obj stability.obj --scene bowl --size 16x9 --radius 1e308 --rays 2 --threads 1 --quick --out names)
check("a mesh may have any name: ${err}" [[status EQUAL 0]])
check("a mesh named stability" "EXISTS ${work}/names/cells/stability-2/shaded.png")
check("a mesh named bowl has no figures" "NOT EXISTS ${work}/names/cells/bowl/figure-2.png")
check("figure 2 of the bowl by another name" "EXISTS ${work}/names/cells/bowl-2/figure-2.png")

# --- progress -------------------------------------------------------------------------------------

# Sets seen to what a terminal shows.
macro(run_in_terminal command)
    execute_process(COMMAND ${SCRIPT} -qec "${command}" /dev/null WORKING_DIRECTORY ${work}
        RESULT_VARIABLE status OUTPUT_VARIABLE seen ERROR_VARIABLE err)
endmacro()
find_program(SCRIPT script)
set(status none)
if(SCRIPT)
    run_in_terminal("test -t 2")
endif()
if(status EQUAL 0)
    set(command "'${PROGRAM}' --scene empty --size 8x8 --rays 2 --threads 1 --quick --radius 1 --out terminal")
    run_in_terminal("${command} >table")
    check("a run on a terminal succeeds: ${seen}" [[status EQUAL 0]])
    foreach(word "[1/1] empty (" " left): " "timing with 1 thread")
        string(FIND "${seen}" "${word}" at)
        check("the terminal shows ${word}" [[NOT at EQUAL -1]])
    endforeach()
    check("the line of progress is wiped" "[==[${seen}]==] MATCHES [==[\r +\r\$]==]")
    file(READ ${work}/table table)
    string(FIND "${table}" "[1/1]" at)
    check("no progress on stdout" [[at EQUAL -1]])

    file(REMOVE_RECURSE ${work}/terminal)
    run_in_terminal("${command} 2>errors")
    check("a run with stderr in a file succeeds: ${seen}" [[status EQUAL 0]])
    string(FIND "${seen}" "RMSE" at)
    check("the terminal shows the table" [[NOT at EQUAL -1]])
    file(READ ${work}/errors errors)
    string(FIND "${seen}${errors}" "[1/1]" at)
    check("no progress when stderr is a file" [[at EQUAL -1]])
    check("nothing at all in that file: ${errors}" [[errors STREQUAL ""]])
else()
    message(STATUS "no script program with a terminal: progress is not tested")
endif()
