// Draws a white ball that probes light, as seen along -y of Blender, and sends the picture's floats to the test.

import * as THREE from 'three';
import { loadProbes, withProbes } from '/photon_bake.js';

const asked = new URLSearchParams( location.search );
const size = Number( asked.get( 'size' ) ), radius = Number( asked.get( 'radius' ) );

async function draw() {

	const content = await ( await fetch( '/scene/Scene_probes.json' ) ).json();
	const probes = await loadProbes( content.grids[ 0 ], '/scene/' );
	const white = new THREE.MeshLambertMaterial( { color: 0xffffff } );
	const ball = new THREE.Mesh( new THREE.SphereGeometry( radius, 128, 64 ), withProbes( white, probes ) );
	ball.position.set( ...asked.get( 'at' ).split( ',' ).map( Number ) );
	const camera = new THREE.OrthographicCamera( - radius, radius, radius, - radius, 0.01, 10 );
	camera.position.copy( ball.position ).add( new THREE.Vector3( 0, 0, 2 ) );
	const scene = new THREE.Scene();
	scene.add( ball );
	const renderer = new THREE.WebGLRenderer();
	const target = new THREE.WebGLRenderTarget( size, size, { type: THREE.FloatType } );
	renderer.setRenderTarget( target );
	renderer.render( scene, camera );
	const pixels = new Float32Array( size * size * 4 );
	renderer.readRenderTargetPixels( target, 0, 0, size, size, pixels );
	return pixels;

}

draw().then(
	( pixels ) => fetch( '/done', { method: 'POST', body: pixels.buffer } ),
	( error ) => fetch( '/failed', { method: 'POST', body: `${ error.stack ?? error }` } )
);
