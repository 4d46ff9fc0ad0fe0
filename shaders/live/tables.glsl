// Where row i of a table is in its texture, which is 4096 texels wide: WIDTH of addon/blender/viewport/tables.py.
ivec2 row_of(int row)
{
  return ivec2(row % 4096, row / 4096);
}
