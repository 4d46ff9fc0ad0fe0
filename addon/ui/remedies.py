"""What can be done about a finding, by a button: its name and its tooltip. The doing is `operators.remedy`'s."""

REMEDIES: dict[str, tuple[str, str]] = {
    "bake_copies": (
        "Turn On Bake Copies",
        "Objects whose mesh cannot hold their light get copies with meshes of their own",
    ),
    "single_user": ("Make Single User", "Give each of these objects a mesh of its own"),
    "convert": ("Convert to Mesh", "Make meshes of these objects"),
    "make_local": ("Make Local", "Take these objects and their meshes into this file"),
    "flip_normals": ("Flip Normals", "Turn the faces of these objects over"),
    "recalculate_outside": ("Recalculate Outside", "Turn the faces of these objects so that they look outwards"),
    "open_side": ("Turn On Open Side", "Where a front sees no light, take that of the back"),
    "refine": ("Refine", "Subdivide faces until they can show the light"),
    "to_lightmaps": ("Bake Lightmaps Instead", "Images show light as fine as their texels, whatever the mesh"),
    "make_uv_map": ("Have One Made", "Choose no UV map: one is made that lies in no place twice"),
    "max_size": ("Double Max Size", "Let images be twice as large"),
    "show_in_renders": ("Show in Renders", "Show these objects in renders"),
    "selected_off": ("Turn Off Selected Only", "Bake to all objects"),
    "final_gather": ("Use Final Gather", "Gather with rays, which light vertices and texels too"),
    "all_lights": ("Bake All Lights", "Choose no light group"),
    "add_light": ("Add Sun", "Add a sun lamp"),
    "add_camera": ("Add Camera", "Add a camera that sees what this view shows"),
    "add_material": ("Add Material", "Give these objects a white material"),
    "find_missing": ("Find Missing Files", "Look for them in a folder"),
    "bake": ("Bake Again", "Bake with the same settings"),
    "quality": ("Raise Quality", "Take the next better quality"),
    "noise": ("Noise 5 %", "Send rays where they are needed until the noise is 5 %"),
}
