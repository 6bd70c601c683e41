# cmake -DFOLDER=server/web -DOUT=page_files.cpp -P embed_page.cmake
# Writes every file of FOLDER as a byte array, for page_files.h.
file(GLOB files RELATIVE "${FOLDER}" "${FOLDER}/*")
list(SORT files)
set(arrays "")
set(table "")
set(number 0)
foreach(name IN LISTS files)
  file(READ "${FOLDER}/${name}" hex HEX)
  string(REGEX REPLACE "(..)" "0x\\1," bytes "${hex}")
  string(APPEND arrays "const unsigned char file_${number}[] = {${bytes}0};\n")
  string(APPEND table "    {\"${name}\", file_${number}, sizeof(file_${number}) - 1},\n")
  math(EXPR number "${number} + 1")
endforeach()
file(WRITE "${OUT}"
  "#include \"server/stream/page_files.h\"\n\nnamespace lumigraft::server {\nnamespace {\n${arrays}}  // namespace\n"
  "const EmbeddedFile embedded_page_files[] = {\n${table}    {nullptr, nullptr, 0}};\n}  // namespace lumigraft::server\n")
