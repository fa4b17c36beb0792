# Run as a script: cmake -DINPUT=report.css -DOUTPUT=report_css.c -DNAME=report_css -P EmbedFile.cmake
# A file's bytes as a C array with a 0 after the end.
file(READ "${INPUT}" bytes HEX)
string(REGEX REPLACE "([0-9a-f][0-9a-f])" "0x\\1," bytes "${bytes}")
string(REGEX REPLACE "((0x..,){24})" "\\1\n    " bytes "${bytes}")
file(WRITE "${OUTPUT}" "#include \"compare/report_parts.h\"\n
const char ${NAME}[] = {\n    ${bytes}0};\n")
