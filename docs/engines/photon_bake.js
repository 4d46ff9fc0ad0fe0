// Baked light of glTF files that Photon Bake exported, in three.js. Tested with three 0.187.

import * as THREE from 'three';
import { EXRLoader } from 'three/addons/loaders/EXRLoader.js';
import { HDRLoader } from 'three/addons/loaders/HDRLoader.js';

/**
 * Light the meshes of a loaded glTF by what was baked, on top of the lights in the scene.
 *
 * @param {THREE.Object3D} root - gltf.scene.
 * @param {string} folder - Where the lightmaps lie, ending in a slash; by default beside the page.
 * @param {{strength?: number, prefer?: 'lightmap' | 'vertex'}} options - Strength of baked light, and what meshes that
 *     have both shall show.
 */
export async function useBakedLight( root, folder = './', { strength = 1, prefer = 'lightmap' } = {} ) {

	const meshes = [], textures = new Map();
	root.traverse( ( object ) => object.isMesh && meshes.push( object ) );

	for ( const mesh of meshes ) {

		const image = extra( mesh, 'lightmap_image' );
		const attribute = extra( mesh, 'light_attribute' )?.toLowerCase(); // as GLTFLoader has it
		const onVertices = attribute !== undefined && mesh.geometry.hasAttribute( attribute );

		if ( image !== undefined && ! ( onVertices && prefer === 'vertex' ) ) {

			if ( ! textures.has( image ) ) textures.set( image, loadLightmap( folder + image ) );
			mesh.material = withLightmap( mesh.material, await textures.get( image ), strength );

		} else if ( onVertices ) {

			mesh.material = withLightOnVertices( mesh.material, attribute, strength );

		}

	}

}

/** A lightmap's texture for glTF's texture coordinates, whose v counts from the top. */
export async function loadLightmap( url ) {

	const loader = url.endsWith( '.exr' ) ? new EXRLoader() : url.endsWith( '.hdr' ) ? new HDRLoader() : null;
	if ( loader === null ) throw new Error( `${ url } is no EXR or HDR image: bake lightmaps in one of these formats.` );
	const texture = await loader.loadAsync( url );
	texture.flipY = ! texture.flipY;
	texture.channel = 1; // TEXCOORD_1
	texture.colorSpace = THREE.LinearSRGBColorSpace;
	texture.wrapS = texture.wrapT = THREE.ClampToEdgeWrapping;
	texture.minFilter = texture.magFilter = THREE.LinearFilter;
	texture.generateMipmaps = false;
	texture.needsUpdate = true;
	return texture;

}

function withLightmap( material, texture, strength ) {

	const lit = material.clone(); // objects share materials, and each may have a lightmap of its own
	lit.lightMap = texture;
	lit.lightMapIntensity = Math.PI * strength; // texels are E/π, and three.js wants E
	return lit;

}

function withLightOnVertices( material, attribute, strength ) {

	const lit = material.clone();
	lit.onBeforeCompile = ( shader ) => {

		shader.uniforms.bakedStrength = { value: Math.PI * strength };
		shader.vertexShader = shader.vertexShader
			.replace( '#include <common>', `#include <common>\nattribute vec3 ${ attribute };\nvarying vec3 vBakedLight;` )
			.replace( '#include <begin_vertex>', `#include <begin_vertex>\nvBakedLight = ${ attribute };` );
		shader.fragmentShader = shader.fragmentShader
			.replace( '#include <common>', '#include <common>\nvarying vec3 vBakedLight;\nuniform float bakedStrength;' )
			.replace(
				'#include <lights_fragment_maps>',
				'#include <lights_fragment_maps>\nirradiance += bakedStrength * max( vBakedLight, 0.0 );'
			);

	};

	lit.customProgramCacheKey = () => `baked light of ${ attribute }`;
	return lit;

}

/** A custom property of a mesh, or of the group that its parts are in where it has several materials. */
function extra( mesh, name ) {

	return mesh.userData[ name ] ?? mesh.parent?.userData[ name ];

}

/**
 * A grid of probes as three 3D textures and the matrix that leads to their coordinates.
 *
 * @param {object} grid - One of `grids` of the JSON file, which was baked with Axes: glTF.
 * @param {string} folder - Where the volumes lie.
 */
export async function loadProbes( grid, folder = './' ) {

	const [ width, height, depth ] = grid.counts;
	const volumes = await Promise.all( [ 'R', 'G', 'B' ].map( async ( color ) => {

		const image = await new EXRLoader().loadAsync( folder + grid.files[ color ] );
		const volume = new THREE.Data3DTexture( rowsFromTop( image.image.data, 4 * width ), width, height, depth );
		volume.format = THREE.RGBAFormat;
		volume.type = image.type;
		volume.minFilter = volume.magFilter = THREE.LinearFilter;
		volume.needsUpdate = true;
		return volume;

	} ) );
	return { volumes, matrix: new THREE.Matrix4().set( ...grid.world_to_texture.flat() ) };

}

/** A copy of a material whose objects are lit by probes where they are. */
export function withProbes( material, { volumes, matrix }, strength = 1 ) {

	const lit = material.clone();
	lit.onBeforeCompile = ( shader ) => {

		[ 'probesR', 'probesG', 'probesB' ].forEach( ( name, i ) => shader.uniforms[ name ] = { value: volumes[ i ] } );
		shader.uniforms.worldToProbes = { value: matrix };
		shader.uniforms.bakedStrength = { value: Math.PI * strength };
		shader.vertexShader = shader.vertexShader
			.replace( '#include <common>', '#include <common>\nuniform mat4 worldToProbes;\nvarying vec3 vAtProbes;' )
			.replace(
				'#include <project_vertex>',
				'#include <project_vertex>\nvAtProbes = ( worldToProbes * modelMatrix * vec4( transformed, 1.0 ) ).xyz;'
			);
		shader.fragmentShader = shader.fragmentShader
			.replace( '#include <common>', `#include <common>\n${ PROBE_LIGHT }` )
			.replace(
				'#include <lights_fragment_maps>',
				'#include <lights_fragment_maps>\n'
				+ 'irradiance += bakedStrength * probeLight( inverseTransformDirection( geometryNormal, viewMatrix ) );'
			);

	};

	lit.customProgramCacheKey = () => 'probes';
	return lit;

}

const PROBE_LIGHT = /* glsl */`
uniform highp sampler3D probesR, probesG, probesB;
uniform float bakedStrength;
varying vec3 vAtProbes;

vec3 probeLight( vec3 normal ) { // E/π

	vec4 n = vec4( 1.0, normal );
	vec4 r = texture( probesR, vAtProbes ), g = texture( probesG, vAtProbes ), b = texture( probesB, vAtProbes );
	return max( vec3( dot( r, n ), dot( g, n ), dot( b, n ) ), 0.0 );

}
`;

/** Rows of a texture's data, which EXRLoader hands out from the lowest, from the top: as slices follow each other. */
function rowsFromTop( data, length ) {

	const turned = new data.constructor( data.length );
	for ( let start = 0; start < data.length; start += length )
		turned.set( data.subarray( start, start + length ), data.length - start - length );
	return turned;

}
